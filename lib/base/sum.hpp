#pragma once

namespace gradpsi {

/// A sum in twice the digits of a double, so that its value hardly ever depends on the order of its terms.
struct Sum {
  double high = 0, low = 0;

  Sum& operator+=(double term) {
    const double sum = high + term, part = sum - high;
    low += (high - (sum - part)) + (term - part);  // what rounding took away, exactly
    high = sum;
    return *this;
  }
  Sum& operator+=(const Sum& other) {
    *this += other.high;
    low += other.low;
    return *this;
  }
  double value() const { return high + low; }
};

}  // namespace gradpsi
