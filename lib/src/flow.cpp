#include "sundials.hpp"

#include <costate/flow.hpp>

namespace costate {

using sundials::check;
using sundials::owned;
using sundials::view;

Statistics& Statistics::operator+=(const Statistics& other) {
  integrations += other.integrations;
  steps += other.steps;
  rhs_evaluations += other.rhs_evaluations;
  sensitivity_evaluations += other.sensitivity_evaluations;
  error_test_failures += other.error_test_failures;
  exhausted += other.exhausted;
  return *this;
}

/// CVODES for one field, one method and one number of directions.
///
/// Quadratures are appended to the state it integrates, y = (z, w), and take no part in anything else. CVODES has a mode of its
/// own for them, but in release 6.4.1 (and 7.5.0) its quadrature sensitivities are wrong with Adams' method: cvAdjustAdams
/// changes the order of every history array but theirs.
class Flow::Integrator {
 public:
  Integrator(const Field& field, Method method, int directions)
      : field_(field),
        method_(method),
        n_(field.states()),
        k_(field.quadratures()),
        d_(directions),
        context_(sundials::make_context()),
        y_(owned(N_VNew_Serial(n_ + k_, context_.get()), "N_VNew_Serial")),
        ys_(y_.get(), d_),
        s_(n_, d_),
        ds_(n_, d_),
        dws_(k_, d_) {}
  Integrator(const Integrator&) = delete;
  Integrator& operator=(const Integrator&) = delete;
  ~Integrator() { CVodeFree(&memory_); }

  [[nodiscard]] Method method() const { return method_; }

  void start(double t0, double t1, const Eigen::VectorXd& z0, const Eigen::VectorXd& p, const Directions& directions,
             const FlowOptions& options) {
    p_ = p;
    sigma_ = directions.parameter;
    view(y_.get()).head(n_) = z0;
    view(y_.get()).tail(k_).setZero();
    for (int j = 0; j < d_; ++j) {
      view(ys_[j]).head(n_) = directions.state.col(j);
      view(ys_[j]).tail(k_).setZero();
    }
    gate_.clear();
    if (memory_ == nullptr) {
      create(t0);
    } else {
      check(CVodeReInit(memory_, t0, y_.get()), "CVodeReInit");
      if (d_ > 0) check(CVodeSensReInit(memory_, CV_SIMULTANEOUS, ys_.get()), "CVodeSensReInit");
    }
    set_tolerances(options.tolerance);
    max_steps_ = options.max_steps;
    check(CVodeSetMaxNumSteps(memory_, max_steps_), "CVodeSetMaxNumSteps");
    check(CVodeSetMaxStep(memory_, options.longest_step * std::abs(t1 - t0)), "CVodeSetMaxStep");  // 0: no limit
    check(CVodeSetStopTime(memory_, t1), "CVodeSetStopTime");
  }

  /// Integrates to t1 and fills `end`.
  void finish(double t1, FlowEnd& end, Statistics& statistics) {
    double t = 0.0;
    advance(t1, CV_NORMAL, t, statistics);
    end.state = view(y_.get()).head(n_);
    end.quadrature = view(y_.get()).tail(k_);
    end.state_directions.resize(n_, d_);
    end.quadrature_directions.resize(k_, d_);
    if (d_ > 0) check(CVodeGetSens(memory_, &t, ys_.get()), "CVodeGetSens");
    for (int j = 0; j < d_; ++j) {
      end.state_directions.col(j) = view(ys_[j]).head(n_);
      end.quadrature_directions.col(j) = view(ys_[j]).tail(k_);
    }
    count(statistics);
  }

  void record(double t1, const Eigen::VectorXd& w0, Trajectory& trajectory, Statistics& statistics) {
    const auto derivative = owned(N_VClone(y_.get()), "N_VClone");
    double t = trajectory.start_time();
    for (long step = 0; t != t1; ++step) {
      // Taken one at a time, steps are not counted by CVODES.
      if (step == max_steps_) {
        count(statistics);
        throw LeftDomain(fmt::format("integration stopped at t = {:.6g}: {}", t, reason(CV_TOO_MUCH_WORK)));
      }
      advance(t1, CV_ONE_STEP, t, statistics);
      int order = 0;
      check(CVodeGetLastOrder(memory_, &order), "CVodeGetLastOrder");
      Eigen::MatrixXd taylor(n_ + k_, order + 1);
      double factorial = 1.0;
      for (int j = 0; j <= order; ++j) {
        if (j > 1) factorial *= j;
        check(CVodeGetDky(memory_, t, j, derivative.get()), "CVodeGetDky");
        taylor.col(j) = view(derivative.get()) / factorial;
      }
      taylor.col(0).tail(k_) += w0;
      trajectory.append({t, std::move(taylor)});
    }
    count(statistics);
  }

 private:
  /// An array of vectors that CVODES reads as N_Vector*.
  class VectorArray {
   public:
    VectorArray(N_Vector like, int count) : count_(count), array_(count > 0 ? N_VCloneVectorArray(count, like) : nullptr) {
      if (count > 0 && array_ == nullptr) throw InternalError("N_VCloneVectorArray returned no object");
    }
    VectorArray(const VectorArray&) = delete;
    VectorArray& operator=(const VectorArray&) = delete;
    ~VectorArray() {
      if (array_ != nullptr) N_VDestroyVectorArray(array_, count_);
    }
    [[nodiscard]] N_Vector* get() const { return array_; }
    N_Vector operator[](int j) const { return array_[j]; }

   private:
    int count_;
    N_Vector* array_;
  };

  // CVODES wants the method, the right-hand sides and the tolerances before the solvers, and the solver of the
  // simultaneous corrector after the sensitivities.
  void create(double t0) {
    const bool adams = method_ == Method::adams;
    memory_ = CVodeCreate(adams ? CV_ADAMS : CV_BDF, context_.get());
    if (memory_ == nullptr) throw InternalError("CVodeCreate returned no object");
    check(CVodeSetErrHandlerFn(memory_, sundials::keep_message, &message_), "CVodeSetErrHandlerFn");
    check(CVodeInit(memory_, rates, t0, y_.get()), "CVodeInit");
    check(CVodeSetUserData(memory_, this), "CVodeSetUserData");
    if (d_ > 0) {
      check(CVodeSensInit(memory_, d_, CV_SIMULTANEOUS, sensitivity_rates, ys_.get()), "CVodeSensInit");
      check(CVodeSetSensErrCon(memory_, SUNTRUE), "CVodeSetSensErrCon");
    }
    set_tolerances({});
    if (adams) {
      // CVODES initialises the solver without sensitivities too, whether it will be used or not.
      nonlinear_ = owned(SUNNonlinSol_FixedPoint(y_.get(), 0, context_.get()), "SUNNonlinSol_FixedPoint");
      check(CVodeSetNonlinearSolver(memory_, nonlinear_.get()), "CVodeSetNonlinearSolver");
    } else {
      matrix_ = owned(SUNDenseMatrix(n_ + k_, n_ + k_, context_.get()), "SUNDenseMatrix");
      linear_ = owned(SUNLinSol_Dense(y_.get(), matrix_.get(), context_.get()), "SUNLinSol_Dense");
      check(CVodeSetLinearSolver(memory_, linear_.get(), matrix_.get()), "CVodeSetLinearSolver");
      check(CVodeSetJacFn(memory_, jacobian), "CVodeSetJacFn");
    }
    if (d_ > 0) {
      simultaneous_ = owned(adams ? SUNNonlinSol_FixedPointSens(d_ + 1, y_.get(), 0, context_.get())
                                  : SUNNonlinSol_NewtonSens(d_ + 1, y_.get(), context_.get()),
                            "SUNNonlinSol_…Sens");
      check(CVodeSetNonlinearSolverSensSim(memory_, simultaneous_.get()), "CVodeSetNonlinearSolverSensSim");
    }
  }

  // A direction of size |s₀| carries an error |s₀| times that of a unit direction: its absolute tolerance follows.
  void set_tolerances(const Tolerance& tolerance) {
    check(CVodeSStolerances(memory_, tolerance.relative, tolerance.absolute), "CVodeSStolerances");
    if (d_ == 0) return;
    absolute_.resize(static_cast<std::size_t>(d_));
    for (int j = 0; j < d_; ++j) {
      const double size = std::max(N_VMaxNorm(ys_[j]), sigma_.size() > 0 ? sigma_.col(j).cwiseAbs().maxCoeff() : 0.0);
      absolute_[static_cast<std::size_t>(j)] = tolerance.absolute * std::max(size, 1.0);
    }
    check(CVodeSensSStolerances(memory_, tolerance.relative, absolute_.data()), "CVodeSensSStolerances");
  }

  void advance(double t1, int task, double& t, Statistics& statistics) {
    const int flag = CVode(memory_, t1, y_.get(), &t, task);
    gate_.rethrow();
    if (flag >= 0) return;
    count(statistics);
    if (flag == CV_TOO_MUCH_WORK) ++statistics.exhausted;
    double reached = 0.0;
    check(CVodeGetCurrentTime(memory_, &reached), "CVodeGetCurrentTime");
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
    long steps = 0, rhs = 0, sens = 0, failures = 0;
    check(CVodeGetNumSteps(memory_, &steps), "CVodeGetNumSteps");
    check(CVodeGetNumRhsEvals(memory_, &rhs), "CVodeGetNumRhsEvals");
    check(CVodeGetNumErrTestFails(memory_, &failures), "CVodeGetNumErrTestFails");
    if (d_ > 0) check(CVodeGetSensNumRhsEvals(memory_, &sens), "CVodeGetSensNumRhsEvals");
    statistics += {.integrations = 1,
                   .steps = steps,
                   .rhs_evaluations = rhs,
                   .sensitivity_evaluations = sens,
                   .error_test_failures = failures};
  }

  static Integrator& self(void* data) { return *static_cast<Integrator*>(data); }

  static int rates(double t, N_Vector y, N_Vector dy, void* data) {
    Integrator& i = self(data);
    return i.gate_.guarded([&] {
      auto rate = view(dy);
      return i.field_.rates(t, view(y).head(i.n_), i.p_, rate.head(i.n_), rate.tail(i.k_));
    });
  }
  static int jacobian(double t, N_Vector y, N_Vector, SUNMatrix j, void* data, N_Vector, N_Vector, N_Vector) {
    Integrator& i = self(data);
    return i.gate_.guarded([&] {
      const int size = i.n_ + i.k_;
      Eigen::Map<Eigen::MatrixXd> whole(SUNDenseMatrix_Data(j), size, size);
      // Nothing depends on w; the rows of w' are left out too: they only make w explicit, which costs no stability.
      whole.setZero();
      return i.field_.jacobian(t, view(y).head(i.n_), i.p_, whole.topLeftCorner(i.n_, i.n_));
    });
  }
  static int sensitivity_rates(int d, double t, N_Vector y, N_Vector, N_Vector* s, N_Vector* ds, void* data, N_Vector,
                               N_Vector) {
    Integrator& i = self(data);
    return i.gate_.guarded([&] {
      for (int j = 0; j < d; ++j) i.s_.col(j) = view(s[j]).head(i.n_);
      const bool finite = i.field_.sensitivities(t, view(y).head(i.n_), i.p_, i.s_, i.sigma_, i.ds_, i.dws_);
      for (int j = 0; j < d; ++j) {
        view(ds[j]).head(i.n_) = i.ds_.col(j);
        view(ds[j]).tail(i.k_) = i.dws_.col(j);
      }
      return finite;
    });
  }

  const Field& field_;
  Method method_;
  int n_, k_, d_;  // states, quadratures, directions
  long max_steps_ = 0;
  sundials::ExceptionGate gate_;
  sundials::Context context_;
  sundials::Vector y_;
  VectorArray ys_;
  sundials::Matrix matrix_;
  sundials::LinearSolver linear_;
  sundials::NonlinearSolver nonlinear_, simultaneous_;
  void* memory_ = nullptr;
  std::string message_;
  Eigen::VectorXd p_;
  Eigen::MatrixXd sigma_, s_, ds_, dws_;
  std::vector<double> absolute_;
};

Flow::Flow(const Field& field, FlowOptions options) : field_(&field), options_(options) {}
Flow::~Flow() = default;
Flow::Flow(Flow&&) noexcept = default;
Flow& Flow::operator=(Flow&&) noexcept = default;

Flow::Integrator& Flow::integrator(Eigen::Index directions) {
  const auto index = static_cast<std::size_t>(directions);
  if (integrators_.size() <= index) integrators_.resize(index + 1);
  auto& slot = integrators_[index];
  if (!slot || slot->method() != options_.method) {
    slot = std::make_unique<Integrator>(*field_, options_.method, static_cast<int>(directions));
  }
  return *slot;
}

const FlowEnd& Flow::run(double t0, double t1, const Eigen::VectorXd& z0, const Eigen::VectorXd& p,
                         const Directions& directions) {
  if (t0 == t1) {
    end_.state = z0;
    end_.quadrature = Eigen::VectorXd::Zero(field_->quadratures());
    end_.state_directions = directions.state;
    end_.quadrature_directions = Eigen::MatrixXd::Zero(field_->quadratures(), directions.count());
  } else {
    Integrator& run = integrator(directions.count());
    run.start(t0, t1, z0, p, directions, options_);
    run.finish(t1, end_, statistics_);
  }
  end_.state_rate.resize(field_->states());
  end_.quadrature_rate.resize(field_->quadratures());
  if (!field_->rates(t1, end_.state, p, end_.state_rate, end_.quadrature_rate)) {
    throw LeftDomain(fmt::format("the right-hand side is not finite at t = {:.6g}", t1));
  }
  return end_;
}

Trajectory Flow::record(double t0, double t1, const Eigen::VectorXd& z0, const Eigen::VectorXd& w0,
                        const Eigen::VectorXd& p) {
  Eigen::VectorXd start(z0.size() + w0.size());
  start << z0, w0;
  Trajectory trajectory(t0, std::move(start));
  if (t0 == t1) return trajectory;
  Integrator& run = integrator(0);
  run.start(t0, t1, z0, p, {Eigen::MatrixXd(z0.size(), 0), Eigen::MatrixXd(p.size(), 0)}, options_);
  run.record(t1, w0, trajectory, statistics_);
  return trajectory;
}

}  // namespace costate
