/// CVODES as an integrator.
#include "integrator.hpp"
#include "sundials.hpp"

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
class Cvodes final : public Integrator {
 public:
  Cvodes(const Field& field, Method method, int directions)
      : field_(field),
        method_(method),
        n_(field.states()),
        k_(field.quadratures()),
        d_(directions),
        context_(sundials::make_context()),
        y_(owned(N_VNew_Serial(n_ + k_, context_.get()), "N_VNew_Serial")),
        ys_(y_.get(), d_),
        state_(static_cast<std::size_t>(n_ * (1 + d_))),
        rates_(static_cast<std::size_t>((n_ + k_) * (1 + d_))) {}
  ~Cvodes() override { CVodeFree(&memory_); }

  [[nodiscard]] Method method() const override { return method_; }
  [[nodiscard]] int directions() const override { return d_; }

  void advance(const InitialValue& start, const FlowOptions& options, std::span<double> end,
               Statistics& statistics) override {
    begin(start, options);
    double t = 0.0;
    step(start.t1, CV_NORMAL, t, statistics);
    if (d_ > 0) check(CVodeGetSens(memory_, &t, ys_.get()), "CVodeGetSens");
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
        throw LeftDomain(fmt::format("integration stopped at t = {:.6g}: {}", t, reason(CV_TOO_MUCH_WORK)));
      }
      step(start.t1, CV_ONE_STEP, t, statistics);
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

  void begin(const InitialValue& start, const FlowOptions& options) {
    parameter_.assign(start.parameter.begin(), start.parameter.end());
    for (int j = 0; j <= d_; ++j) {
      auto column = view(j == 0 ? y_.get() : ys_[j - 1]);
      for (int i = 0; i < n_; ++i) column[i] = start.state[static_cast<std::size_t>(i * (1 + d_) + j)];
      column.tail(k_).setZero();
    }
    gate_.clear();
    if (memory_ == nullptr) {
      create(start.t0);
    } else {
      check(CVodeReInit(memory_, start.t0, y_.get()), "CVodeReInit");
      if (d_ > 0) check(CVodeSensReInit(memory_, CV_SIMULTANEOUS, ys_.get()), "CVodeSensReInit");
    }
    set_tolerances(options.tolerance);
    max_steps_ = options.max_steps;
    check(CVodeSetMaxNumSteps(memory_, max_steps_), "CVodeSetMaxNumSteps");
    check(CVodeSetMaxStep(memory_, options.longest_step * std::abs(start.t1 - start.t0)), "CVodeSetMaxStep");  // 0: no limit
    check(CVodeSetStopTime(memory_, start.t1), "CVodeSetStopTime");
  }

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
      const double size = std::max(N_VMaxNorm(ys_[j]), largest_parameter(j));
      absolute_[static_cast<std::size_t>(j)] = tolerance.absolute * std::max(size, 1.0);
    }
    check(CVodeSensSStolerances(memory_, tolerance.relative, absolute_.data()), "CVodeSensSStolerances");
  }

  /// max |σ| of a direction.
  [[nodiscard]] double largest_parameter(int j) const {
    double largest = 0.0;
    for (auto i = static_cast<std::size_t>(1 + j); i < parameter_.size(); i += static_cast<std::size_t>(1 + d_)) {
      largest = std::max(largest, std::abs(parameter_[i]));
    }
    return largest;
  }

  /// The first `count` entries of y and of every direction, number by number.
  void gather(N_Vector y, N_Vector* s, int count, std::span<double> numbers) const {
    for (int j = 0; j <= d_; ++j) {
      const auto column = view(j == 0 ? y : s[j - 1]);
      for (int i = 0; i < count; ++i) numbers[static_cast<std::size_t>(i * (1 + d_) + j)] = column[i];
    }
  }

  void step(double t1, int task, double& t, Statistics& statistics) {
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

  static Cvodes& self(void* data) { return *static_cast<Cvodes*>(data); }

  /// p without its derivatives.
  [[nodiscard]] Eigen::Map<const Eigen::VectorXd, 0, Eigen::InnerStride<>> plain_parameter() const {
    return {parameter_.data(), field_.parameters(), Eigen::InnerStride<>(1 + d_)};
  }
  static int rates(double t, N_Vector y, N_Vector dy, void* data) {
    Cvodes& i = self(data);
    return i.gate_.guarded([&] {
      auto rate = view(dy);
      return i.field_.rates(t, view(y).head(i.n_), i.plain_parameter(), rate.head(i.n_), rate.tail(i.k_));
    });
  }
  static int jacobian(double t, N_Vector y, N_Vector, SUNMatrix j, void* data, N_Vector, N_Vector, N_Vector) {
    Cvodes& i = self(data);
    return i.gate_.guarded([&] {
      const int size = i.n_ + i.k_;
      Eigen::Map<Eigen::MatrixXd> whole(SUNDenseMatrix_Data(j), size, size);
      // Nothing depends on w; the rows of w' are left out too: they only make w explicit, which costs no stability.
      whole.setZero();
      return i.field_.jacobian(t, view(y).head(i.n_), i.plain_parameter(), whole.topLeftCorner(i.n_, i.n_));
    });
  }
  static int sensitivity_rates(int d, double t, N_Vector y, N_Vector, N_Vector* s, N_Vector* ds, void* data, N_Vector,
                               N_Vector) {
    Cvodes& i = self(data);
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
  std::vector<double> parameter_, state_, rates_;
  std::vector<double> absolute_;
};

}  // namespace

std::unique_ptr<Integrator> make_cvodes(const Field& field, Method method, int directions) {
  return std::make_unique<Cvodes>(field, method, directions);
}

}  // namespace costate
