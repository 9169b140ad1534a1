/// \file
/// A number that knows its derivatives with respect to the unknowns of a shooting problem.
///
/// Jets are what shooting functions are written on: value and a sparse gradient, column by column of the problem's unknowns.
/// An arc's end state comes back from the integrator as jets (the chain rule through the flow is applied there), so the
/// Jacobian of a whole multi-arc problem is exact, and a row that touches two arcs stores two arcs' columns only.
#pragma once

#include <costate/dual.hpp>
#include <costate/short_vector.hpp>

namespace costate {

/// value + Σ gradient over the columns that are present; columns ascend.
class Jet {
 public:
  struct Entry {
    int column;
    double derivative;
  };
  /// Problems of single shooting have few unknowns: their gradients need no memory of their own.
  using Gradient = ShortVector<Entry, 8>;

  double value = 0.0;

  Jet() = default;
  Jet(double constant) : value(constant) {}  // NOLINT: constants mix freely with variables
  Jet(double v, Gradient g) : value(v), gradient_(std::move(g)) {}
  Jet(const Jet& a) : value(a.value) { append(a); }
  Jet(Jet&&) = default;
  Jet& operator=(const Jet& a) {
    if (this == &a) return *this;
    value = a.value;
    gradient_.clear();
    append(a);
    return *this;
  }
  Jet& operator=(Jet&&) = default;
  ~Jet() = default;

  /// The unknown of the given column, with an optional rate: d(this)/d(column) = rate.
  static Jet variable(double value, int column, double rate = 1.0) { return {value, {{column, rate}}}; }

  [[nodiscard]] const Gradient& gradient() const { return gradient_; }
  /// ∂/∂column, 0 if absent.
  [[nodiscard]] double derivative(int column) const;

  /// f(a) by the chain rule.
  static Jet chain(const Jet& a, double f, double derivative) {
    Jet r(f);
    Entry* to = r.gradient_.extend(a.gradient_.size());
    for (const Entry& from : a.gradient_) {
      to->column = from.column;
      to++->derivative = derivative * from.derivative;
    }
    return r;
  }
  /// f(a, b) by the chain rule.
  static Jet chain(const Jet& a, const Jet& b, double f, double fa, double fb) {
    if (b.gradient_.empty()) return chain(a, f, fa);
    if (a.gradient_.empty()) return chain(b, f, fb);
    return merge(a, b, f, fa, fb);
  }

  Jet& operator+=(const Jet& b) { return *this = *this + b; }
  Jet& operator-=(const Jet& b) { return *this = *this - b; }
  friend Jet operator-(const Jet& a) { return chain(a, -a.value, -1.0); }
  friend Jet operator+(const Jet& a, const Jet& b) { return chain(a, b, a.value + b.value, 1.0, 1.0); }
  friend Jet operator-(const Jet& a, const Jet& b) { return chain(a, b, a.value - b.value, 1.0, -1.0); }
  friend Jet operator*(const Jet& a, const Jet& b) { return chain(a, b, a.value * b.value, b.value, a.value); }
  friend Jet operator/(const Jet& a, const Jet& b) {
    return chain(a, b, a.value / b.value, 1.0 / b.value, -a.value / (b.value * b.value));
  }

 private:
  // Number by number: what has just been written by numbers is read so faster than in wider pieces.
  void append(const Jet& a) {
    Entry* to = gradient_.extend(a.gradient_.size());
    for (const Entry& from : a.gradient_) {
      to->column = from.column;
      to++->derivative = from.derivative;
    }
  }
  static Jet merge(const Jet& a, const Jet& b, double f, double fa, double fb);

  Gradient gradient_;
};

/// Jets of one arc: its states, quadratures or constants.
using Jets = ShortVector<Jet, 5>;

inline double primal(const Jet& a) { return a.value; }
inline Jet sin(const Jet& a) { return Jet::chain(a, std::sin(a.value), std::cos(a.value)); }
inline Jet cos(const Jet& a) { return Jet::chain(a, std::cos(a.value), -std::sin(a.value)); }
inline Jet exp(const Jet& a) { return Jet::chain(a, std::exp(a.value), std::exp(a.value)); }
inline Jet log(const Jet& a) { return Jet::chain(a, std::log(a.value), 1.0 / a.value); }
/// Square root of a quantity that must not be negative. \throws LeftDomain naming `what` if it is.
Jet sqrt(const Jet& a, const char* what = "argument of a square root");

}  // namespace costate
