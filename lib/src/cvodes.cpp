/// CVODES as an integrator.
#include "corrector.hpp"
#include "integrator.hpp"

#include <algorithm>
#include <optional>

namespace costate {

using sundials::check;
using sundials::owned;
using sundials::view;

namespace {

/// CVODES for one field, one method and one number of directions.
///
/// Quadratures are appended to the state it integrates, y = (z, w), and take no part in anything else. CVODES has a mode of its
/// own for them, but in release 6.4.1 (and 7.5.0) its quadrature sensitivities are wrong with Adams' method: cvAdjustAdams
/// changes the order of every history array but theirs.
///
/// In the augmented system every number of y is followed by its directions; else those are vectors of their own.
class Cvodes final : public Integrator {
 public:
  Cvodes(const Field& field, Method method, int directions)
      : field_(field),
        method_(method),
        n_(field.states()),
        k_(field.quadratures()),
        d_(directions),
        absolute_(static_cast<std::size_t>(1 + d_)),
        plain_parameter_(static_cast<std::size_t>(field.parameters())),
        plain_state_(n_),
        context_(sundials::make_context()) {}

  [[nodiscard]] Method method() const override { return method_; }
  [[nodiscard]] int directions() const override { return d_; }

  void advance(const InitialValue& start, const FlowOptions& options, std::span<double> end,
               Statistics& statistics) override {
    begin(start, options);
    double t = 0.0;
    step(start.t1, CV_NORMAL, t, statistics);
    if (forward_ > 0) check(CVodeGetSens(memory_.get(), &t, ys_.get()), "CVodeGetSens");
    gather(y_.get(), ys_.get(), n_ + k_, end);
    count(statistics);
  }

  void record(const InitialValue& start, const Eigen::VectorXd& w0, const FlowOptions& options, Trajectory& trajectory,
              Statistics& statistics) override {
    begin(start, options);
    const auto derivative = owned(N_VClone(y_.get()), "N_VClone");
    double t = start.t0;
    for (long taken = 0; t != start.t1; ++taken) {
      // Taken one at a time, steps are not counted by CVODES.
      if (taken == max_steps_) {
        count(statistics);
        ++statistics.exhausted;
        throw LeftDomain(fmt::format("integration stopped at t = {:.6g}: {}", t, reason(CV_TOO_MUCH_WORK)));
      }
      step(start.t1, CV_ONE_STEP, t, statistics);
      int order = 0;
      check(CVodeGetLastOrder(memory_.get(), &order), "CVodeGetLastOrder");
      Eigen::MatrixXd taylor(n_ + k_, order + 1);
      double factorial = 1.0;
      for (int j = 0; j <= order; ++j) {
        if (j > 1) factorial *= j;
        check(CVodeGetDky(memory_.get(), t, j, derivative.get()), "CVodeGetDky");
        taylor.col(j) = view(derivative.get()) / factorial;
      }
      taylor.col(0).tail(k_) += w0;
      trajectory.append({t, std::move(taylor)});
    }
    count(statistics);
  }

 private:
  /// Vectors that CVODES reads as N_Vector*.
  class VectorArray {
   public:
    VectorArray() = default;
    VectorArray(N_Vector like, int count) {
      for (int j = 0; j < count; ++j) handles_.push_back(vectors_.emplace_back(owned(N_VClone(like), "N_VClone")).get());
    }
    [[nodiscard]] N_Vector* get() { return handles_.data(); }
    N_Vector operator[](int j) const { return handles_[static_cast<std::size_t>(j)]; }

   private:
    std::vector<sundials::Vector> vectors_;
    std::vector<N_Vector> handles_;
  };

  struct Free {
    void operator()(void* memory) const { CVodeFree(&memory); }
  };

  void begin(const InitialValue& start, const FlowOptions& options) {
    const auto way = options.sensitivities.value_or(method_ == Method::adams ? Sensitivities::augmented
                                                                             : Sensitivities::simultaneous);
    if (memory_ == nullptr || (d_ > 0 && way != sensitivities_)) create(start.t0, way);
    parameter_.assign(start.parameter.begin(), start.parameter.end());
    for (std::size_t i = 0; i < plain_parameter_.size(); ++i)
      plain_parameter_[i] = parameter_[i * static_cast<std::size_t>(1 + d_)];
    scatter(start.state);
    gate_.clear();
    evaluations_ = sensitivity_evaluations_ = 0;
    check(CVodeReInit(memory_.get(), start.t0, y_.get()), "CVodeReInit");
    if (forward_ > 0) check(CVodeSensReInit(memory_.get(), mode(), ys_.get()), "CVodeSensReInit");
    set_tolerances(start.state, options.tolerance);
    max_steps_ = options.max_steps;
    check(CVodeSetMaxNumSteps(memory_.get(), max_steps_), "CVodeSetMaxNumSteps");
    check(CVodeSetMaxStep(memory_.get(), options.longest_step * std::abs(start.t1 - start.t0)),
          "CVodeSetMaxStep");  // 0: no limit
    check(CVodeSetStopTime(memory_.get(), start.t1), "CVodeSetStopTime");
  }

  [[nodiscard]] int mode() const { return sensitivities_ == Sensitivities::staggered ? CV_STAGGERED : CV_SIMULTANEOUS; }

  // CVODES wants the method, the right-hand sides and the tolerances before the solvers, and the solver of the
  // sensitivities' corrector after the sensitivities.
  void create(double t0, Sensitivities sensitivities) {
    sensitivities_ = sensitivities;
    forward_ = sensitivities == Sensitivities::augmented ? 0 : d_;
    columns_ = 1 + d_ - forward_;
    memory_.reset();
    ys_ = {};
    y_ = sundials::make_vector(n_ + k_, columns_, context_.get());
    ys_ = VectorArray(y_.get(), forward_);
    state_.resize(static_cast<std::size_t>(forward_ > 0 ? n_ * (1 + d_) : 0));
    rates_.resize(static_cast<std::size_t>(forward_ > 0 ? (n_ + k_) * (1 + d_) : 0));

    const bool adams = method_ == Method::adams;
    memory_.reset(CVodeCreate(adams ? CV_ADAMS : CV_BDF, context_.get()));
    void* memory = memory_.get();
    if (memory == nullptr) throw InternalError("CVodeCreate returned no object");
    check(CVodeSetErrHandlerFn(memory, sundials::keep_message, &message_), "CVodeSetErrHandlerFn");
    check(CVodeInit(memory, rates, t0, y_.get()), "CVodeInit");
    check(CVodeSetUserData(memory, this), "CVodeSetUserData");
    if (forward_ > 0) {
      check(CVodeSensInit(memory, d_, mode(), sensitivity_rates, ys_.get()), "CVodeSensInit");
      check(CVodeSetSensErrCon(memory, SUNTRUE), "CVodeSetSensErrCon");
      check(CVodeSensSStolerances(memory, 0.0, absolute_.data()), "CVodeSensSStolerances");
    }
    check(CVodeWFtolerances(memory, weights), "CVodeWFtolerances");
    if (adams) {
      // CVODES initialises the solver without sensitivities too, whether it will be used or not.
      nonlinear_ = sundials::make_fixed_point(rates, context_.get());
      check(CVodeSetNonlinearSolver(memory, nonlinear_.get()), "CVodeSetNonlinearSolver");
    } else {
      newton_.emplace(n_, n_ + k_, context_.get());
      check(CVodeSetLinearSolver(memory, newton_->solver(), newton_->matrix()), "CVodeSetLinearSolver");
      check(CVodeSetLinSysFn(memory, newton_matrix), "CVodeSetLinSysFn");
    }
    if (forward_ > 0) set_sensitivity_solver(adams);
  }

  void set_sensitivity_solver(bool adams) {
    const bool simultaneous = sensitivities_ == Sensitivities::simultaneous;
    const int vectors = simultaneous ? 1 + d_ : d_;
    sensitivity_solver_ = owned(adams ? SUNNonlinSol_FixedPointSens(vectors, y_.get(), 0, context_.get())
                                      : SUNNonlinSol_NewtonSens(vectors, y_.get(), context_.get()),
                                "SUNNonlinSol_…Sens");
    if (simultaneous) {
      check(CVodeSetNonlinearSolverSensSim(memory_.get(), sensitivity_solver_.get()), "CVodeSetNonlinearSolverSensSim");
    } else {
      check(CVodeSetNonlinearSolverSensStg(memory_.get(), sensitivity_solver_.get()), "CVodeSetNonlinearSolverSensStg");
    }
  }

  // A direction of size |s₀| carries an error |s₀| times that of a unit direction: its absolute tolerance follows.
  void set_tolerances(std::span<const double> state, const Tolerance& tolerance) {
    relative_ = tolerance.relative;
    absolute_[0] = tolerance.absolute;
    for (int j = 1; j <= d_; ++j) {
      absolute_[static_cast<std::size_t>(j)] = tolerance.absolute *
                                               std::max({largest(state, j), largest(parameter_, j), 1.0});
    }
    if (forward_ > 0) check(CVodeSensSStolerances(memory_.get(), relative_, absolute_.data() + 1), "CVodeSensSStolerances");
  }

  /// The largest derivative in direction j of numbers that are followed by their derivatives.
  [[nodiscard]] double largest(std::span<const double> numbers, int j) const {
    double size = 0.0;
    for (auto i = static_cast<std::size_t>(j); i < numbers.size(); i += static_cast<std::size_t>(1 + d_)) {
      size = std::max(size, std::abs(numbers[i]));
    }
    return size;
  }

  /// z and its directions to where they are integrated; w and its directions are zero.
  void scatter(std::span<const double> state) {
    const auto stride = static_cast<std::size_t>(1 + d_), columns = static_cast<std::size_t>(columns_);
    auto y = view(y_.get());
    y.tail(k_ * columns_).setZero();
    for (std::size_t i = 0; i < static_cast<std::size_t>(n_); ++i) {
      std::copy_n(state.data() + i * stride, columns, y.data() + i * columns);
    }
    for (int j = 0; j < forward_; ++j) {
      auto direction = view(ys_[j]);
      direction.tail(k_).setZero();
      for (int i = 0; i < n_; ++i)
        direction[i] = state[static_cast<std::size_t>(i) * stride + static_cast<std::size_t>(1 + j)];
    }
  }
  /// The first `count` numbers of y with their directions.
  void gather(N_Vector y, N_Vector* s, int count, std::span<double> numbers) const {
    const auto stride = static_cast<std::size_t>(1 + d_), columns = static_cast<std::size_t>(columns_);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      std::copy_n(N_VGetArrayPointer(y) + i * columns, columns, numbers.data() + i * stride);
    }
    for (int j = 0; j < forward_; ++j) {
      const auto direction = view(s[j]);
      for (int i = 0; i < count; ++i)
        numbers[static_cast<std::size_t>(i) * stride + static_cast<std::size_t>(1 + j)] = direction[i];
    }
  }

  void step(double t1, int task, double& t, Statistics& statistics) {
    const int flag = CVode(memory_.get(), t1, y_.get(), &t, task);
    gate_.rethrow();
    if (flag >= 0) return;
    count(statistics);
    if (flag == CV_TOO_MUCH_WORK) ++statistics.exhausted;
    double reached = 0.0;
    check(CVodeGetCurrentTime(memory_.get(), &reached), "CVodeGetCurrentTime");
    throw LeftDomain(fmt::format("integration stopped at t = {:.6g}: {}", reached, reason(flag)));
  }

  /// Why an integration ended early. \throws InternalError where the reason is not the problem's.
  [[nodiscard]] std::string reason(int flag) const {
    switch (flag) {
      case CV_TOO_MUCH_WORK: return "the step limit is exhausted";
      case CV_TOO_MUCH_ACC: return "the tolerance is below what double precision can hold";
      case CV_ERR_FAILURE:
      case CV_CONV_FAILURE: return "the step size is exhausted";
      case CV_TOO_CLOSE: return "the arc is too short to integrate";
      case CV_LSETUP_FAIL:
      case CV_FIRST_RHSFUNC_ERR:
      case CV_REPTD_RHSFUNC_ERR:
      case CV_UNREC_RHSFUNC_ERR:
      case CV_FIRST_SRHSFUNC_ERR:
      case CV_REPTD_SRHSFUNC_ERR:
        return "the right-hand side is not finite" + (gate_.reason().empty() ? "" : ": " + gate_.reason());
      default: throw InternalError(fmt::format("CVode failed with flag {}: {}", flag, message_));
    }
  }

  void count(Statistics& statistics) const {
    long steps = 0, failures = 0;
    check(CVodeGetNumSteps(memory_.get(), &steps), "CVodeGetNumSteps");
    check(CVodeGetNumErrTestFails(memory_.get(), &failures), "CVodeGetNumErrTestFails");
    statistics += {.integrations = 1,
                   .steps = steps,
                   .rhs_evaluations = evaluations_,
                   .sensitivity_evaluations = columns_ > 1 ? evaluations_ : sensitivity_evaluations_,
                   .error_test_failures = failures};
  }

  static Cvodes& self(void* data) { return *static_cast<Cvodes*>(data); }

  static int weights(N_Vector y, N_Vector w, void* data) {
    const Cvodes& i = self(data);
    return sundials::set_weights(y, i.relative_, i.absolute_.data(), w) ? 0 : -1;
  }
  static int rates(double t, N_Vector y, N_Vector dy, void* data) {
    Cvodes& i = self(data);
    ++i.evaluations_;
    return i.gate_.guarded([&] {
      const auto columns = static_cast<std::size_t>(i.columns_);
      const std::span<const double> p = i.forward_ > 0 ? i.plain_parameter_ : i.parameter_;
      return i.field_.variation(t, {N_VGetArrayPointer(y), static_cast<std::size_t>(i.n_) * columns}, p, i.columns_ - 1,
                                {N_VGetArrayPointer(dy), static_cast<std::size_t>(i.n_ + i.k_) * columns});
    });
  }
  static int newton_matrix(double t, N_Vector y, N_Vector, SUNMatrix, booleantype keep, booleantype* renewed, double gamma,
                           void* data, N_Vector, N_Vector, N_Vector) {
    Cvodes& i = self(data);
    return i.gate_.guarded([&] {
      *renewed = keep ? SUNFALSE : SUNTRUE;
      if (!keep) {
        for (int row = 0; row < i.n_; ++row) i.plain_state_[row] = N_VGetArrayPointer(y)[row * i.columns_];
        const Eigen::Map<const Eigen::VectorXd> p(i.plain_parameter_.data(), i.field_.parameters());
        if (!i.field_.jacobian(t, i.plain_state_, p, i.newton_->jacobian())) return false;
      }
      return i.newton_->factorise(gamma);
    });
  }
  static int sensitivity_rates(int d, double t, N_Vector y, N_Vector, N_Vector* s, N_Vector* ds, void* data, N_Vector,
                               N_Vector) {
    Cvodes& i = self(data);
    ++i.sensitivity_evaluations_;
    return i.gate_.guarded([&] {
      i.gather(y, s, i.n_, i.state_);
      const bool finite = i.field_.variation(t, i.state_, i.parameter_, d, i.rates_);
      for (int j = 0; j < d; ++j) {
        auto column = view(ds[j]);
        for (int row = 0; row < i.n_ + i.k_; ++row) column[row] = i.rates_[static_cast<std::size_t>(row * (1 + d) + 1 + j)];
      }
      return finite;
    });
  }

  const Field& field_;
  Method method_;
  int n_, k_, d_;  // states, quadratures, directions
  Sensitivities sensitivities_ = Sensitivities::augmented;
  int forward_ = 0, columns_ = 1;  // directions in vectors of their own; columns of y
  long max_steps_ = 0, evaluations_ = 0, sensitivity_evaluations_ = 0;
  double relative_ = 0.0;
  std::vector<double> absolute_;                     // of y and of each direction
  std::vector<double> parameter_, plain_parameter_;  // p with its derivatives, without
  std::vector<double> state_, rates_;                // of forward sensitivities
  Eigen::VectorXd plain_state_;                      // z without its derivatives
  std::string message_;
  sundials::ExceptionGate gate_;
  sundials::Context context_;
  sundials::Vector y_;
  VectorArray ys_;
  std::optional<sundials::NewtonMatrix> newton_;
  sundials::NonlinearSolver nonlinear_, sensitivity_solver_;
  std::unique_ptr<void, Free> memory_;
};

}  // namespace

std::unique_ptr<Integrator> make_cvodes(const Field& field, Method method, int directions) {
  return std::make_unique<Cvodes>(field, method, directions);
}

}  // namespace costate
