#include "vector.hpp"

#include <costate/nonlinear.hpp>

#include <optional>

namespace costate {

using sundials::check;
using sundials::owned;
using sundials::view;

const char* describe(Termination termination) {
  switch (termination) {
    case Termination::converged: return "converged";
    case Termination::small_step: return "the Newton step became too small to go on";
    case Termination::stalled: return "the line search found no decrease of the residual";
    case Termination::iteration_limit: return "the limit of Newton iterations was reached";
    case Termination::step_limit: return "five steps in a row had the maximum length: the iteration diverges";
    case Termination::left_domain: return "the iterate ran into the border of the model's domain";
    case Termination::singular_jacobian: return "the Jacobian is singular";
  }
  return "unknown";
}

bool NonlinearSystem::factorise(const Eigen::VectorXd& y) {
  Eigen::MatrixXd whole(size(), size());
  jacobian(y, whole);
  if (!whole.allFinite()) return false;
  dense_.compute(whole);
  return (dense_.matrixLU().diagonal().array() != 0.0).all();
}

struct Kinsol::Memory {
  explicit Memory(Eigen::Index n)
      : context(sundials::make_context()),
        y(sundials::make_vector(static_cast<int>(n), 1, context.get())),
        y_weight(owned(N_VClone(y.get()), "N_VClone")),
        r_weight(owned(N_VClone(y.get()), "N_VClone")),
        matrix(owned(SUNMatNewEmpty(context.get()), "SUNMatNewEmpty")),
        linear(owned(SUNLinSolNewEmpty(context.get()), "SUNLinSolNewEmpty")),
        residual(n),
        step(n) {
    // To KINSOL the Jacobian is an opaque matrix with a direct solver: both stand for the system's own.
    matrix->ops->getid = [](SUNMatrix) { return SUNMATRIX_CUSTOM; };
    matrix->ops->zero = [](SUNMatrix) { return 0; };
    linear->content = this;
    linear->ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; };
    linear->ops->setup = [](SUNLinearSolver, SUNMatrix) { return 0; };
    linear->ops->solve = solve;
    linear->ops->free = [](SUNLinearSolver solver) {
      SUNLinSolFreeEmpty(solver);
      return 0;
    };
    kinsol = KINCreate(context.get());
    if (kinsol == nullptr) throw InternalError("KINCreate returned no object");
    check(KINSetErrHandlerFn(kinsol, sundials::keep_message, &message), "KINSetErrHandlerFn");
    check(KINInit(kinsol, evaluate, y.get()), "KINInit");
    check(KINSetUserData(kinsol, this), "KINSetUserData");
    check(KINSetLinearSolver(kinsol, linear.get(), matrix.get()), "KINSetLinearSolver");
    check(KINSetJacFn(kinsol, differentiate), "KINSetJacFn");
    check(KINSetMaxSetupCalls(kinsol, 1), "KINSetMaxSetupCalls");  // the default re-uses a Jacobian for ten steps
  }
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;
  ~Memory() { KINFree(&kinsol); }

  static int evaluate(N_Vector y, N_Vector r, void* data) {
    Memory& m = *static_cast<Memory*>(data);
    // Where R carries the noise of an integration KINSOL's line search can bisect for ever.
    if (++m.evaluations > m.most_evaluations) return -1;
    const int flag = m.gate.guarded([&] {
      m.point = view(y);
      m.system->residual(m.point, m.residual);
      view(r) = m.residual;
      return m.residual.allFinite();
    });
    // After a recoverable failure KINSOL halves a full step, but some paths of its line search give up. A residual that no
    // search accepts makes them backtrack too.
    if (flag > 0 && m.line_search && m.evaluations > 1) {
      view(r).setConstant(1e100);
      return 0;
    }
    return flag;
  }
  static int differentiate(N_Vector y, N_Vector, SUNMatrix, void* data, N_Vector, N_Vector) {
    Memory& m = *static_cast<Memory*>(data);
    return m.gate.guarded([&] {
      m.point = view(y);
      return m.system->factorise(m.point);
    });
  }
  static int solve(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, realtype) {
    Memory& m = *static_cast<Memory*>(solver->content);
    return m.gate.guarded([&] {
      m.system->solve(view(b), m.step);
      view(x) = m.step;
      return m.step.allFinite();
    });
  }

  /// KINSOL asks a hundred times more of the first guess than of an iterate, and would go on into the noise.
  std::optional<NewtonResult> already_converged(const Eigen::VectorXd& row_scale, double tolerance) {
    point = view(y.get());
    try {
      system->residual(point, residual);
    } catch (const LeftDomain&) {
      return std::nullopt;  // KINSOL meets it again and says so
    }
    const Eigen::VectorXd scaled = residual.cwiseQuotient(row_scale);
    if (!scaled.allFinite() || scaled.cwiseAbs().maxCoeff() > tolerance) return std::nullopt;
    return NewtonResult{.residual_evaluations = 1, .residual_norm = scaled.norm()};
  }

  sundials::ExceptionGate gate;
  sundials::Context context;
  sundials::Vector y, y_weight, r_weight;
  sundials::Matrix matrix;
  sundials::LinearSolver linear;
  void* kinsol = nullptr;
  std::string message;
  NonlinearSystem* system = nullptr;
  bool line_search = true;
  long evaluations = 0, most_evaluations = 0;
  Eigen::VectorXd point, residual, step;
};

Kinsol::Kinsol(Eigen::Index size) : memory_(std::make_unique<Memory>(size)) {}
Kinsol::~Kinsol() = default;
Kinsol::Kinsol(Kinsol&&) noexcept = default;
Kinsol& Kinsol::operator=(Kinsol&&) noexcept = default;

namespace {

Termination termination(int flag, const std::string& message) {
  switch (flag) {
    case KIN_SUCCESS:
    case KIN_INITIAL_GUESS_OK: return Termination::converged;
    case KIN_STEP_LT_STPTOL: return Termination::small_step;
    case KIN_LINESEARCH_NONCONV:
    case KIN_LINESEARCH_BCFAIL: return Termination::stalled;
    case KIN_MAXITER_REACHED: return Termination::iteration_limit;
    case KIN_MXNEWT_5X_EXCEEDED: return Termination::step_limit;
    case KIN_SYSFUNC_FAIL:
    case KIN_FIRST_SYSFUNC_ERR:
    case KIN_REPTD_SYSFUNC_ERR: return Termination::left_domain;
    case KIN_LSETUP_FAIL:
    case KIN_LSOLVE_FAIL:
    case KIN_LINSOLV_NO_RECOVERY: return Termination::singular_jacobian;
    default: throw InternalError(fmt::format("KINSol failed with flag {}: {}", flag, message));
  }
}

}  // namespace

NewtonResult Kinsol::solve(NonlinearSystem& system, Eigen::VectorXd& y, const Eigen::VectorXd& unknown_scale,
                           const Eigen::VectorXd& row_scale, const NewtonOptions& options) {
  Memory& m = *memory_;
  m.system = &system;
  m.gate.clear();
  m.line_search = options.line_search;
  m.evaluations = 0;
  m.most_evaluations = 20 + 8L * options.max_iterations;
  view(m.y.get()) = y;
  view(m.y_weight.get()) = unknown_scale.cwiseInverse();
  view(m.r_weight.get()) = row_scale.cwiseInverse();
  // Set at every solve: KINSOL derives the default maximum step from the first guess it ever saw.
  check(KINSetMaxNewtonStep(m.kinsol, options.max_step), "KINSetMaxNewtonStep");
  check(KINSetFuncNormTol(m.kinsol, options.residual_tolerance), "KINSetFuncNormTol");
  check(KINSetScaledStepTol(m.kinsol, options.step_tolerance), "KINSetScaledStepTol");
  check(KINSetNumMaxIters(m.kinsol, options.max_iterations), "KINSetNumMaxIters");

  if (const auto done = m.already_converged(row_scale, options.residual_tolerance)) return *done;
  const int flag = KINSol(m.kinsol, m.y.get(), options.line_search ? KIN_LINESEARCH : KIN_NONE, m.y_weight.get(),
                          m.r_weight.get());
  m.gate.rethrow();
  NewtonResult result;
  result.termination = m.evaluations > m.most_evaluations ? Termination::stalled : termination(flag, m.message);
  y = view(m.y.get());
  long iterations = 0;
  check(KINGetNumNonlinSolvIters(m.kinsol, &iterations), "KINGetNumNonlinSolvIters");
  check(KINGetNumFuncEvals(m.kinsol, &result.residual_evaluations), "KINGetNumFuncEvals");
  check(KINGetFuncNorm(m.kinsol, &result.residual_norm), "KINGetFuncNorm");
  result.iterations = static_cast<int>(iterations);
  result.message = m.gate.reason();
  return result;
}

}  // namespace costate
