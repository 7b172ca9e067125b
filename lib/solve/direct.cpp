#include "solve/direct.hpp"

#include <optional>

#include "solve/cholesky.hpp"
#include "solve/errors.hpp"
#include "solve/lu.hpp"
#include "solve/ordering.hpp"

namespace gradpsi {
namespace {

void factorise(std::optional<Cholesky>& factor, const LinearSystem& system) {
  const SolverOptions& options = system.options;
  if (!factor)
    factor.emplace(system.A, system.scale, elimination(system, system.A), options.memory,
                   options.threads);
  if (!factor->factorise(system.A)) throw Indefinite();
}

void factorise(std::optional<Lu>& factor, const LinearSystem& system) {
  const SolverOptions& options = system.options;
  if (!factor)
    factor.emplace(system.A, elimination(system, system.A), options.memory, options.threads);
  factor->factorise(system.A);
}

template <class Factor>
class Direct : public PreparedMethod {
 public:
  explicit Direct(const char* name) : name_(name) {}

  void prepare(const LinearSystem& system, const Choice&) override { factorise(factor_, system); }

  bool solve(const LinearSystem& system, Columns& columns, int, SolveReport& result) override {
    return refine(system, columns, result,
                  [this](const Eigen::MatrixXd& from, Eigen::MatrixXd& to) {
                    factor_->solve(from.data(), to.data(), static_cast<int>(from.cols()));
                  });
  }

  std::string description() const override {
    return std::string(name_) + " (" + factor_->report().description + ")";
  }
  FactorReport factor() const override { return factor_->report(); }

 private:
  const char* name_;
  std::optional<Factor> factor_;
};

}  // namespace

std::unique_ptr<PreparedMethod> make_cholesky() {
  return std::make_unique<Direct<Cholesky>>("Cholesky");
}
std::unique_ptr<PreparedMethod> make_lu() { return std::make_unique<Direct<Lu>>("LU"); }

}  // namespace gradpsi
