/// The regular solution at the singular end of a contact arc.
#include "curvature_problem.hpp"

#include <costate/error.hpp>

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <limits>

namespace costate::curvature {

namespace {

/// Derivatives with respect to θ_f, η_f, μ and β̂.
using D = Dual<double, 4>;
using Series = std::array<D, end_order + 1>;

/// Coefficient j of the product a b.
D product(const Series& a, const Series& b, std::size_t j) {
  D sum;
  for (std::size_t i = 0; i <= j; ++i) sum += a[i] * b[j - i];
  return sum;
}

/// The series of everything the arc needs, built one order at a time.
struct Builder {
  Series theta{}, eta{}, n{}, log_v{}, x{}, y{}, t{};
  D mu, beta;

  Builder(const D& theta_end, const D& eta_end, const D& friction, const D& growth) : mu(friction), beta(growth) {
    theta[0] = theta_end;
    eta[0] = eta_end;
    v[0] = 1.0;
    sine[0] = sin(theta_end);
    cosine[0] = cos(theta_end);
    for (std::size_t j = 0; j <= end_order; ++j) {
      if (j > 0) advance(j);
      products(j, true);
    }
  }

 private:
  /// Coefficient j of all but η from the rates' coefficients up to j − 1; then η from the equation that degenerates at s = 0:
  /// 6β̂ n η_s + (B_θ + B k') + n Q = 0. η_j enters it as 6β̂ η₀ (j + 1) η_j, since n₁ = η₀ and B₀ = 1.
  void advance(std::size_t j) {
    const double order = static_cast<double>(j);
    const auto rate = [&](const Series& factor) { return product(eta, factor, j - 1) / order; };
    theta[j] = -rate(turn);
    log_v[j] = -rate(gain);
    n[j] = rate(loss);
    D sine_rate, cosine_rate, v_rate;
    for (std::size_t i = 1; i <= j; ++i) {
      const double weight = static_cast<double>(i) / order;
      sine_rate += weight * theta[i] * cosine[j - i];
      cosine_rate -= weight * theta[i] * sine[j - i];
      v_rate += weight * log_v[i] * v[j - i];
    }
    sine[j] = sine_rate;
    cosine[j] = cosine_rate;
    v[j] = v_rate;
    t[j] = -rate(v);
    x[j] = -product(eta, v2_cosine, j - 1) / order;
    y[j] = -product(eta, v2_sine, j - 1) / order;
    eta[j] = 0.0;
    products(j, false);
    D rest = B_theta[j] + product(B, slope, j) + product(n, Q, j);
    for (std::size_t i = 2; i <= j; ++i) rest += 6.0 * beta * n[i] * static_cast<double>(j - i + 1) * eta[j - i + 1];
    eta[j] = -rest / (6.0 * beta * eta[0] * (order + 1.0));
  }

  /// Coefficient j of whatever is made of the series; Q and what the next order needs only when η_j is known.
  void products(std::size_t j, bool whole) {
    if (j == 0) {
      // B = 1 and B_θ = −k'(η) at the end, by H = 0 and by regularity.
      const D k_slope = 3.0 * beta * eta[0] * eta[0] - mu;
      lambda_x = cosine[0] + k_slope * sine[0];
      lambda_y = sine[0] - k_slope * cosine[0];
    }
    B[j] = lambda_x * cosine[j] + lambda_y * sine[j];
    B_theta[j] = lambda_y * cosine[j] - lambda_x * sine[j];
    const D constant = j == 0 ? mu : D(0.0);
    quadratic[j] = beta * product(eta, eta, j);
    slope[j] = 3.0 * quadratic[j] - constant;
    k_per_eta[j] = quadratic[j] - constant;
    if (!whole) return;
    k[j] = product(eta, k_per_eta, j);
    turn[j] = eta[j] - cosine[j];
    v2[j] = product(v, v, j);
    v2_cosine[j] = product(v2, cosine, j);
    v2_sine[j] = product(v2, sine, j);
    turning[j] = product(slope, turn, j);
    gain[j] = k[j] - sine[j];
    inner[j] = turning[j] + gain[j];
    loss[j] = B[j] + product(n, inner, j);
    difference[j] = turning[j] - k[j];
    Q[j] = product(slope, difference, j) - cosine[j];
  }

  Series sine{}, cosine{}, v{}, v2{}, v2_cosine{}, v2_sine{};
  Series quadratic{}, k_per_eta{}, k{}, slope{}, turn{}, turning{};
  Series B{}, B_theta{}, gain{}, inner{}, loss{}, difference{}, Q{};
  D lambda_x, lambda_y;
};

/// The s below which the last two terms of a series are below rounding of its first.
double reach_of(const Series& series, double size) {
  double reach = std::numeric_limits<double>::infinity();
  for (std::size_t j : {series.size() - 2, series.size() - 1}) {
    const double last = std::abs(series[j].value);
    if (last == 0.0) continue;
    reach = std::min(reach,
                     std::pow(0.1 * std::numeric_limits<double>::epsilon() * size / last, 1.0 / static_cast<double>(j)));
  }
  return reach;
}

Jet to_jet(const D& a, const std::array<Jet, 4>& inputs) {
  Jet sum(a.value);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    if (!inputs[i].gradient().empty()) sum += Jet::chain(inputs[i], 0.0, a.gradient[i]);
  }
  return sum;
}

}  // namespace

Jet EndArc::at(Series series, double s) const {
  Jet sum;
  for (std::size_t j = coefficient[series].size(); j-- > 0;) sum = coefficient[series][j] + sum * s;
  return sum;
}

EndArc end_arc(const Jet& theta, const Jet& eta, const Jet& mu, const Jet& beta) {
  if (!(eta.value > 0.0)) {
    throw LeftDomain(
        fmt::format("the normal force at the end of the last contact arc is {:.3g} g: it must be positive", eta.value));
  }
  const std::array<Jet, 4> inputs{theta, eta, mu, beta};
  const Builder built(D::variable(theta.value, 0), D::variable(eta.value, 1), D::variable(mu.value, 2),
                      D::variable(beta.value, 3));
  EndArc arc;
  const Series* series[EndArc::count]{&built.x, &built.y, &built.t, &built.log_v, &built.theta, &built.eta, &built.n};
  for (std::size_t i = 0; i < EndArc::count; ++i) {
    for (const D& c : *series[i]) arc.coefficient[i].push_back(to_jet(c, inputs));
  }
  // n starts at 0 and grows like η₀ s: its terms are measured by that.
  arc.reach = std::min({reach_of(built.theta, 1.0), reach_of(built.eta, eta.value), reach_of(built.log_v, 1.0),
                        reach_of(built.n, eta.value * 1e-2)});
  return arc;
}

}  // namespace costate::curvature
