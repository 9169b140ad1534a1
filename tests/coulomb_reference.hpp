/// \file
/// Reference cases of the bead with Coulomb friction, and the closed form of the optimum by a quadrature that shares nothing
/// with the library.
#pragma once

#include <costate/models/coulomb.hpp>

#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace costate::test {

struct CoulombCase {
  std::string name;
  coulomb::Scene scene;
  std::map<std::string, double> values;   ///< by the names of the reports
  std::map<std::string, double> per_mu;   ///< their derivatives by μ, as far as given
  std::optional<double> turn;             ///< φ_F
  std::map<std::string, double> kurilin;  ///< time, alpha0, alphaF, C; empty if not given

  /// What the digits of the reference (16), and the rounding of its decimal μ to a double, leave open of a value.
  [[nodiscard]] double unknown(const std::string& report) const {
    const double unit = std::ldexp(1.0, -52), value = std::abs(values.at(report));
    const auto slope = per_mu.find(report);
    // Where no derivative is given: nothing falls faster towards the limit than H/L − μ itself.
    const double per_friction = slope == per_mu.end() ? value / (largest_friction(scene) - scene.friction)
                                                      : std::abs(slope->second);
    return unit * (4.0 * value + per_friction * scene.friction);
  }
};

inline void PrintTo(const CoulombCase& c, std::ostream* out) { *out << c.name; }

inline nlohmann::json coulomb_data() {
  std::ifstream file(std::string(COSTATE_REFERENCE_DIR) + "/coulomb.json");
  return nlohmann::json::parse(file);
}

inline std::vector<CoulombCase> coulomb_cases() {
  std::vector<CoulombCase> cases;
  const nlohmann::json data = coulomb_data();
  for (const auto& entry : data.at("cases")) {
    const auto &p = entry.at("params"), &optimum = entry.at("true");
    CoulombCase c;
    c.name = entry.at("id").get<std::string>();
    c.scene = {p.at("H"), p.at("L"), p.at("g"), p.at("mu")};
    const std::pair<const char*, const char*> fields[] = {{"T", "final_time"},  {"lx", "lambda_x"},   {"ly", "lambda_y"},
                                                          {"lv0", "lambda_v0"}, {"alpha0", "alpha0"}, {"alphaF", "alphaF"},
                                                          {"vF", "end_speed"}};
    for (const auto& [key, report] : fields) {
      if (optimum.contains(key) && optimum.at(key).is_number()) c.values[report] = optimum.at(key);
      if (entry.contains("d_dmu") && entry.at("d_dmu").is_object() && entry.at("d_dmu").contains(key)) {
        c.per_mu[report] = entry.at("d_dmu").at(key);
      }
    }
    if (optimum.contains("phiF") && optimum.at("phiF").is_number()) c.turn = optimum.at("phiF").get<double>();
    if (entry.contains("kurilin") && entry.at("kurilin").is_object()) {
      const auto& k = entry.at("kurilin");
      c.kurilin = {{"final_time", k.at("T")}, {"alpha0", k.at("alpha0")}, {"alphaF", k.at("alphaF")}, {"C", k.at("C")}};
    }
    cases.push_back(std::move(c));
  }
  return cases;
}

/// Where the closed form leads from given costates: with u = tan α from ∞ to u_F, ε = 1 + 2μu_F − μ², P = (u − μ)² + ε,
/// G = P + 4μ(u − u_F): x = K∫G/P³ du, y = K∫uG/P³ du, t = √(K/g)∫G/P² du, K = A²/g, A = (1 + μu_F)/λx, λy = (u_F − μ)/A.
struct CoulombEnd {
  long double x, y, t;
};

inline CoulombEnd coulomb_closed_form(const coulomb::Scene& s, double lambda_x, double lambda_y) {
  // The sum (1 + μ²) and the products tell A and u_F from the costates.
  const long double mu = s.friction, g = s.gravity;
  const long double A = (1 + mu * mu) / (lambda_x - mu * lambda_y), end = mu + A * lambda_y;
  const long double epsilon = 1 + 2 * mu * end - mu * mu;
  // Where P is least the integrand peaks: the integral is cut there. Each part by u = cut ± w, w = exp(π/2 sinh τ).
  CoulombEnd sum{0, 0, 0};
  const auto add = [&](long double u, long double weight) {
    const long double P = (u - mu) * (u - mu) + epsilon, G = P + 4 * mu * (u - end);
    sum.x += weight * G / (P * P * P);
    sum.y += weight * u * G / (P * P * P);
    sum.t += weight * G / (P * P);
  };
  constexpr long double h = 1.0L / 64, half_pi = 1.57079632679489661923L;
  const long double cut = std::max(mu, end);
  for (int i = -64 * 5; i <= 64 * 5; ++i) {
    const long double tau = i * h, w = std::sqrt(epsilon) * std::exp(half_pi * std::sinh(tau));
    add(cut + w, h * w * half_pi * std::cosh(tau));
    // between end and cut: q = 1/(1 + exp(−π sinh τ))
    if (cut == end) continue;
    const long double e = std::exp(-2 * half_pi * std::sinh(tau)), q = 1 / (1 + e), rest = e / (1 + e);
    add(cut - (cut - end) * q, h * (cut - end) * 2 * half_pi * std::cosh(tau) * q * rest);
  }
  const long double K = A * A / g;
  return {K * sum.x, K * sum.y, std::sqrt(K / g) * sum.t};
}

}  // namespace costate::test
