#!/usr/bin/env python3
"""Tables and plot data from the benchmarks' JSON.

    python3 benchmarks/report.py build/results/benchmarks.json [--dat DIR]

prints Markdown; --dat writes DIR/benchmarks_{sizes,roof,orders}.dat for benchmarks.gp. Times are
medians where there were repetitions. A share of the roof is bytes that must be moved, each once, per
second, relative to op:roof/impl:read of the same run with as many threads.
"""

import argparse
import json
import os
import statistics
import sys

OPERATIONS = {
    "roof": "The memory: reading an array, and a = b + s c",
    "tree": "The k-d tree alone",
    "search": "Neighbour lists",
    "spacing": "The local spacing of points without volumes",
    "weights": "Assembly: weights and new matrices",
    "refill": "Other weights in the same matrices",
    "forms": "Rows of degree 2: other weights in the same matrices",
    "probes": "Values between the points",
    "fused": "A gradient and a Laplacian in one pass, and one after the other",
    "fill": "The filling of one matrix from known entries",
    "spmv": "Products y = A x",
    "gradient": "Products with all matrices of a gradient",
    "divergence": "The divergence of vectors: one pass, and one product after the other",
    "curl": "Their curl, likewise",
    "velocity-gradient": "All derivatives of all components, likewise",
    "onthefly": "The Laplacian's sums without a matrix",
    "convert": "Conversion of a matrix",
}


class Row:
    """One benchmark: the keys of its name, its counters, its time in seconds."""

    def __init__(self, entry):
        name = entry.get("run_name", entry["name"])
        self.keys = dict(part.split(":", 1) for part in name.split("/") if ":" in part)
        unit = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}[entry.get("time_unit", "ms")]
        self.seconds = entry.get("real_time", 0) * unit
        self.cores = entry.get("cpu_time", 0) / entry["real_time"] if entry.get("real_time") else 0
        self.counters = entry
        self.name = "/".join(part for part in name.split("/") if ":" in part)
        self.spread = None
        self.threads = int(self.keys["threads"])

    def __getitem__(self, key):
        return self.keys.get(key, "")

    def counter(self, name):
        return self.counters.get(name)

    def identity(self):
        """All keys but the threads."""
        return tuple((k, v) for k, v in self.keys.items() if k != "threads")


def load(path):
    with open(path, encoding="utf-8") as file:
        data = json.load(file)
    rows, spreads, failed = {}, {}, []
    for entry in data["benchmarks"]:
        name = entry.get("run_name", entry["name"])
        kind = entry.get("aggregate_name")
        if entry.get("error_occurred"):
            failed.append(f"{name}: {entry.get('error_message')}")
        elif kind == "cv":
            spreads[name] = entry["real_time"]
        elif kind == "median" or (kind is None and name not in rows):
            rows[name] = Row(entry)
    for name, spread in spreads.items():
        if name in rows:
            rows[name].spread = spread
    return data["context"], list(rows.values()), failed


class Results:
    def __init__(self, rows):
        self.rows = rows
        self.roof = {r.threads: r.counter("GB_per_s") for r in rows
                     if r["op"] == "roof" and r["impl"] == "read"}

    def share(self, row):
        rate, roof = row.counter("GB_per_s"), self.roof.get(row.threads)
        return 100 * rate / roof if rate and roof else None

    def find(self, **wanted):
        """The one row that has these keys, and none of another scheme, or nothing."""
        found = [r for r in self.rows
                 if all(r[k] == str(v) for k, v in wanted.items())]
        return found[0] if len(found) == 1 else None


def number(value, digits=3):
    if value is None:
        return ""
    text = f"{value:.{digits}g}"
    return f"{value:,.0f}" if "e" in text else text


def size(text):
    return f"{int(text):,}" if text else ""


def cells(by_threads, value):
    """One thread / two."""
    shown = [value(row) for _, row in sorted(by_threads.items())]
    return " / ".join(shown) if any(shown) else ""


def table(results, operation):
    groups = {}
    for row in results.rows:
        if row["op"] == operation:
            groups.setdefault(row.identity(), {})[row.threads] = row
    if not groups:
        return
    columns = [
        ("impl", lambda g, r: r["impl"]),
        ("scheme", lambda g, r: r["scheme"]),
        ("dim", lambda g, r: r["dim"]),
        ("points", lambda g, r: size(r["n"])),
        ("h/dx", lambda g, r: r["ratio"]),
        ("grading", lambda g, r: r["grading"]),
        ("order", lambda g, r: r["order"]),
        ("neighbours", lambda g, r: number(r.counter("neighbours"))),
        ("ms", lambda g, r: cells(g, lambda x: number(1e3 * x.seconds))),
        ("ns a point", lambda g, r: cells(g, lambda x: number(x.counter("ns_per_point")))),
        ("ns an entry", lambda g, r: cells(g, lambda x: number(x.counter("ns_per_entry")))),
        ("GB/s", lambda g, r: cells(g, lambda x: number(x.counter("GB_per_s")))),
        ("of roof, %", lambda g, r: cells(g, lambda x: number(results.share(x), 2))),
    ]
    lines = [[value(group, next(iter(group.values()))) for _, value in columns]
             for group in groups.values()]
    used = [c for c in range(len(columns)) if any(line[c] for line in lines)]
    print(f"\n## {OPERATIONS.get(operation, operation)} (`op:{operation}`)\n")
    print("| " + " | ".join(columns[c][0] for c in used) + " |")
    print("|" + "---|" * len(used))
    for line in lines:
        print("| " + " | ".join(line[c] for c in used) + " |")


def payback(cost, slow, fast):
    """The number of applications after which `cost` is saved."""
    gain = slow.seconds - fast.seconds
    return f"after {number(cost.seconds / gain, 2)}" if gain > 0 else "never"


def paybacks(results):
    scenes = {}
    for row in results.rows:
        if row["op"] in ("convert", "onthefly"):
            scene = {k: row[k] for k in ("dim", "n", "ratio", "grading", "order", "threads")}
            scenes[tuple(scene.items())] = scene
    lines = []
    for scene in scenes.values():
        find = lambda op, impl, scheme="": results.find(op=op, impl=impl, scheme=scheme, **scene)
        product, sell = find("spmv", "gradpsi"), find("spmv", "sell")
        zoc, soc = "laplacian-mixed-zoc", "laplacian-mixed-soc"
        convert, loop = find("convert", "sell"), find("onthefly", "loop", zoc)
        weights, refill = find("weights", "gradpsi", zoc), find("refill", "gradpsi", soc)
        if not product:
            continue
        cells = [scene["dim"], size(scene["n"]), scene["threads"],
                 payback(convert, product, sell) if convert and sell else "",
                 payback(weights, loop, product) if weights and loop else "",
                 number(refill.seconds / product.seconds, 2) if refill else ""]
        lines.append("| " + " | ".join(cells) + " |")
    if lines:
        print("\n## What pays, in products\n")
        print("| dim | points | threads | conversion to SELL pays | a zoc matrix rather than its sums "
              "on the fly pays | refilling a soc matrix costs |")
        print("|---|---|---|---|---|---|")
        print("\n".join(lines))


def heading(context, results, failed):
    print("# Benchmarks\n")
    cpu = context.get("cpu", "unknown processor")
    load = ", ".join(f"{x:.1f}" for x in context.get("load_avg", [])) or "unknown"
    print(f"{context.get('date', '')[:10]}, {cpu}, {context.get('num_cpus')} cores; compiler "
          f"{context.get('compiler', '?')}, Eigen {context.get('eigen', '?')}; load before: {load}.")
    spreads = sorted((r.spread, r.name) for r in results.rows
                     if r.spread is not None)
    if spreads:
        middle = statistics.median(s for s, _ in spreads)
        print(f"Medians of repetitions, whose standard deviation is {100 * middle:.1f} % in the "
              f"middle and at most {100 * spreads[-1][0]:.0f} % ({spreads[-1][1]}).")
    else:
        print("Single runs: good for seeing that everything works, not for conclusions.")
    print("One thread / two. Entries are those of the whole matrix, however it is stored.")
    roof = next((r for r in results.rows if r["op"] == "roof" and r.threads == 2), None)
    if roof and roof.cores < 1.6:
        print(f"\n**Two threads had {roof.cores:.1f} cores: something else was running, and times "
              "with two threads mean nothing.**")
    for line in failed:
        print(f"\n**Failed: {line}**")


def write_dat(path, header, lines):
    with open(path, "w", encoding="utf-8") as file:
        file.write("# " + header + "\n")
        for line in lines:
            file.write(" ".join(str(x) for x in line) + "\n")


def write_sizes(results, folder):
    """Cost against the number of points, at the usual support, in tree order."""
    curves = {"search": "gradpsi", "weights": "gradpsi", "spmv": "gradpsi"}
    lines = [(r["op"], r["dim"], r["n"], r.threads, r.counter("ns_per_point"))
             for r in results.rows
             if curves.get(r["op"]) == r["impl"] and r["order"] == "tree" and not r["ratio"] and not r["grading"]
             and r["scheme"] in ("", "laplacian-mixed-soc")]
    lines.sort(key=lambda x: (x[0], x[1], x[3], int(x[2])))
    write_dat(os.path.join(folder, "benchmarks_sizes.dat"), "op dim n threads ns_per_point", lines)


def products(results):
    """The products in the scene with the most points of each dimension that has all of them."""
    sizes = {}
    for r in results.rows:
        if r["op"] == "spmv" and r["impl"] == "sell":
            sizes[r["dim"]] = max(int(r["n"]), sizes.get(r["dim"], 0))
    return [r for r in results.rows
            if r["op"] == "spmv" and not r["ratio"] and sizes.get(r["dim"]) == int(r["n"])]


def write_roof(results, folder):
    """The share of the roof of each product in tree order, the worst at the bottom."""
    shares = {}
    for r in products(results):
        if r["order"] == "tree" and results.share(r):
            shares.setdefault(r["impl"], {})[(r["dim"], r.threads)] = results.share(r)
    ranked = sorted(shares, key=lambda impl: shares[impl].get(("2", 1), 0))
    lines = [(place + 1, impl, dim, threads, round(share, 2))
             for place, impl in enumerate(ranked)
             for (dim, threads), share in sorted(shares[impl].items())]
    write_dat(os.path.join(folder, "benchmarks_roof.dat"), "place impl dim threads share", lines)


def write_orders(results, folder):
    orders = ["tree", "lattice", "rcm", "random"]
    lines = [(orders.index(r["order"]) + 1, r["order"], r["impl"], r["dim"], r.threads,
              r.counter("ns_per_entry")) for r in products(results) if r["order"] in orders]
    lines.sort(key=lambda x: (x[2], x[3], x[4], x[0]))  # the points of a curve together
    write_dat(os.path.join(folder, "benchmarks_orders.dat"),
              "place order impl dim threads ns_per_entry", lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("json")
    parser.add_argument("--dat", metavar="DIR", help="write plot data there")
    arguments = parser.parse_args()
    context, rows, failed = load(arguments.json)
    results = Results(rows)
    heading(context, results, failed)
    for operation in OPERATIONS:
        table(results, operation)
    paybacks(results)
    if arguments.dat:
        for write in (write_sizes, write_roof, write_orders):
            write(results, arguments.dat)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
