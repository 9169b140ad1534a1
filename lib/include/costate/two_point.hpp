/// \file
/// A user's own two-point boundary-value problem:
///
///   y' = f(t, y, p),  a ≤ t ≤ b,  y ∈ ℝⁿ, p ∈ ℝᵐ,   g(y(a), y(b), p) = 0,
///
/// with values of the states fixed at either end, parameters known or to be found, further conditions at interior points,
/// right-hand sides that change from piece to piece, and an end b that may be free. There is no optimal control in it. The
/// right-hand side is stated once on a generic scalar; every derivative the solve needs is taken from it.
///
/// ```cpp
/// struct Troesch {  // y'' = μ sinh(μ y)
///   static constexpr int states = 2, parameters = 1;
///   template <class S>
///   Vec<S, 2> rates(const S& t, const Vec<S, 2>& y, const Vec<S, 1>& p) const { return {y[1], p[0] * sinh(p[0] * y[0])}; }
/// };
/// TwoPoint problem(Troesch{}, 0.0, 1.0);
/// problem.state("y", {.start = 0.0, .end = 1.0}).state("y'").parameter("mu", 5.0);
/// const Solution s = solve(problem.shared(), {.accuracy = 1e-8});  // s["y'(0)"], s["y'(1)"], s.at(0.5)
/// ```
///
/// Background: Ascher, Mattheij & Russell, Numerical Solution of Boundary Value Problems for Ordinary Differential Equations,
/// SIAM 1995, ch. 1 and 4.
#pragma once

#include <costate/problem.hpp>

#include <functional>

namespace costate {

/// A right-hand side on a generic scalar: y' (n) at t, y (n), p (m).
template <class F>
concept RightHandSide = requires(const F f, double t, Vec<double, F::states> y, Vec<double, F::parameters> p) {
  { f.rates(t, y, p) } -> std::same_as<Vec<double, F::states>>;
};

[[noreturn]] void throw_outside(std::size_t place, std::size_t size);

/// Values a condition is stated on, numbered from 0.
template <class S>
class Values {
 public:
  Values(const S* first, std::size_t size) : first_(first), size_(size) {}
  /// \throws BadInput for a place there is not.
  const S& operator[](std::size_t i) const {
    if (i >= size_) throw_outside(i, size_);
    return first_[i];
  }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  const S* first_;
  std::size_t size_;
};

/// What a boundary row is stated on: y(a), y(b), p and the two ends.
template <class S>
struct Boundary {
  Values<S> start, end, parameter;
  S a, b;
};

/// What an interior row is stated on: t, y(t), p.
template <class S>
struct Interior {
  S t;
  Values<S> state, parameter;
};

/// The scalar rows are evaluated on: derivatives with respect to four of a row's inputs at a time.
using RowScalar = Dual<double, 4>;

/// A state. A value given at an end is a condition, and a scene parameter named like the value, "y(0)"; a start value that is not
/// given is an unknown of that name.
struct TwoPointState {
  std::optional<double> start{}, end{};
  std::optional<double> guess{};  ///< of the value at an end where it is not fixed; none: that of the other end, or 0
  double scale = 1.0;             ///< a typical magnitude, above 0: in a layer of width ε that of a slope is 1/ε
  std::string unit{};
};

/// A parameter to be found.
struct FreeParameter {
  double guess = 0.0;
  double scale = 1.0;                                       ///< a typical magnitude, above 0
  double lower = -std::numeric_limits<double>::infinity();  ///< a root with a value at or beyond a limit is no solution
  double upper = std::numeric_limits<double>::infinity();
};

class TwoPoint {
 public:
  /// y' = f(t, y, p) from a to b.
  template <RightHandSide F>
  TwoPoint(F f, double a, double b) : states_wanted_(F::states), parameters_wanted_(F::parameters), points_{a} {
    then(std::move(f), b);
  }

  /// The next state, in the order of y.
  TwoPoint& state(std::string name, TwoPointState state = {});
  /// The next parameter, in the order of p: a known one, which a solution can be continued in …
  TwoPoint& parameter(std::string name, double value, std::string unit = "");
  /// … or one to be found.
  TwoPoint& unknown_parameter(std::string name, FreeParameter free = {});
  /// The end b is to be found, beyond the last point before it; the value given for it is its guess.
  TwoPoint& free_end(std::string name, double scale = 1.0);
  /// From the present end on another right-hand side holds, up to `end`. The states are continuous.
  template <RightHandSide F>
  TwoPoint& then(F f, double end) {
    return append(std::make_shared<FieldOf<Piece<F>>>(Piece<F>{std::move(f)}), end);
  }

  /// A condition g = 0: `g` is a generic lambda on a Boundary<S> that returns an S. `scale` is the magnitude of what cancels.
  TwoPoint& row(std::string name, std::function<RowScalar(const Boundary<RowScalar>&)> g, double scale = 1.0);
  /// A condition g = 0 at an interior point: `g` is a generic lambda on an Interior<S>.
  TwoPoint& row_at(std::string name, double point, std::function<RowScalar(const Interior<RowScalar>&)> g,
                   double scale = 1.0);

  /// A guess of the solution, t → y(t) (n values). Without it: linear between the values at the ends, fixed or guessed.
  TwoPoint& guess(std::function<std::vector<double>(double)> y);

  /// The problem as it is stated now. Its unknowns: the start values that are not fixed, the parameters to be found, the free end.
  /// Its rows: the fixed end values, then the rows in the order they were stated. Reported are the values of the states at a,
  /// at b and at every point between at which something happens, as "y(0)", "y(0.5)", "y(1)", except those that are unknowns. The
  /// columns of its trajectory are t and y; a trajectory's own clock starts with 0 at a.
  /// \throws BadInput, naming what is wrong: points that do not ascend, states or parameters that are not described or not
  /// used by f, names used twice, numbers that are not finite, scales that are not positive, a guess of the wrong size, a row that
  /// reads values there are not, more or fewer conditions than unknowns.
  [[nodiscard]] std::shared_ptr<const Problem> shared() const;

 private:
  template <RightHandSide F>
  struct Piece {
    static constexpr int states = F::states, parameters = F::parameters, quadratures = 0;
    F f;
    template <class S>
    Rates<S, states, 0> rates(const S& t, const Vec<S, states>& y, const Vec<S, parameters>& p) const {
      return {f.rates(t, y, p), {}};
    }
  };
  struct NamedState : TwoPointState {
    std::string name;
  };
  struct NamedParameter : FreeParameter {
    std::string name, unit;
    bool known = true;
  };
  struct Condition {
    std::string name;
    double scale;
    std::optional<double> point;  ///< none: at the ends
    std::function<RowScalar(const Boundary<RowScalar>&)> ends;
    std::function<RowScalar(const Interior<RowScalar>&)> inside;
  };
  class Assembled;

  TwoPoint& append(std::shared_ptr<const Field> field, double end);
  void check_points() const;
  void check_states() const;
  void check_parameters() const;
  void check_names() const;

  int states_wanted_, parameters_wanted_;
  std::vector<double> points_;  ///< a, the ends of the pieces
  std::vector<std::shared_ptr<const Field>> pieces_;
  std::vector<NamedState> states_;
  std::vector<NamedParameter> parameters_;
  std::optional<std::string> free_end_;
  double end_scale_ = 1.0;
  std::vector<Condition> conditions_;
  std::function<std::vector<double>(double)> guess_;
};

}  // namespace costate
