/// \file
/// The reference cases of the rolling disk: 18–20 digits, computed with elliptic functions and multiple-precision Taylor series.
#pragma once

#include <costate/models/disk.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <ostream>
#include <string>

namespace costate::test {

struct DiskCase {
  std::string name;
  std::string structure;  ///< F free, C saturated, B boundary
  disk::Scene scene;
  std::map<std::string, double> values;  ///< by the names of the problem's reports
  disk::Chain chain{};                   ///< the arcs with their ends, if the reference has them
};

/// How test failures name a case.
inline void PrintTo(const DiskCase& c, std::ostream* out) { *out << c.name; }

inline double reference_number(const std::string& text) {
  if (text == "sqrt6") return std::sqrt(6.0);
  if (text == "pi/2") return std::numbers::pi / 2;
  if (text == "pi/4") return std::numbers::pi / 4;
  return std::stod(text);
}

/// The arcs between the states of a reference. V' has the sign of the change of V, which is monotone on its saturated arcs.
inline disk::Chain disk_chain(const nlohmann::json& entry, const disk::Scene& scene, const std::string& structure) {
  const double T = scene.radius / std::sqrt(6.0) / scene.speed;
  const double kappa = *scene.friction * scene.gravity * T / scene.speed;
  disk::Chain chain{reference_number(entry.at("lambda_x").get<std::string>()) * scene.speed,
                    reference_number(entry.at("lambda_y").get<std::string>()) * scene.speed,
                    {}};
  const auto number = [](const nlohmann::json& object, const auto& key) {
    return std::stod(object.at(key).template get<std::string>());
  };
  for (std::size_t i = 0; i < structure.size(); ++i) {
    const auto& states = entry.at("states");
    const double V = number(states[i], "V") / scene.speed, V_end = number(states[i + 1], "V") / scene.speed;
    disk::ArcSpan arc;
    arc.duration = (number(entry.at("t_junctions"), i + 1) - number(entry.at("t_junctions"), i)) / T;
    if (structure[i] == 'C') arc.type = {disk::ArcKind::saturated, V_end > V ? 1.0 : -1.0};
    if (structure[i] == 'B') arc.type = {disk::ArcKind::boundary, V * V > 0.5 ? 1.0 : -1.0};
    const auto state = [&](const nlohmann::json& at) {
      const double speed = number(at, "V") / scene.speed;
      const double rest = structure[i] == 'C' ? kappa * kappa - speed * speed * (1.0 - speed * speed) : 0.0;
      return disk::ArcState{number(at, "phi"), speed, arc.type.sign * std::sqrt(std::max(0.0, rest)),
                            number(at, "lambda_phi") / T};
    };
    arc.begin = state(states[i]);
    arc.end = state(states[i + 1]);
    chain.arcs.push_back(arc);
  }
  return chain;
}

inline std::vector<DiskCase> disk_cases() {
  std::ifstream file(std::string(COSTATE_REFERENCE_DIR) + "/disk.json");
  const auto data = nlohmann::json::parse(file);
  std::vector<DiskCase> cases;
  for (const auto& [name, entry] : data.at("cases").items()) {
    const auto& params = entry.at("params");
    const auto number = [&](const char* key) { return reference_number(params.at(key).get<std::string>()); };
    DiskCase c{name, entry.at("structure").get<std::string>(), {}, {}};
    c.scene.x = number("xf");
    c.scene.y = number("yf");
    c.scene.heading = number("pf");
    c.scene.radius = number("r");
    c.scene.speed = number("c1");
    if (params.contains("k")) c.scene.friction = number("k");
    const std::pair<const char*, const char*> fields[] = {{"t_f", "final_time"},   {"lambda_x", "lambda_x"},
                                                          {"lambda_y", "lambda_y"}, {"lambda_phi0", "lambda_phi0"},
                                                          {"V0", "V0"},             {"Omega0", "Omega0"}};
    for (const auto& [key, report] : fields) {
      if (entry.contains(key)) c.values[report] = std::stod(entry.at(key).get<std::string>());
    }
    if (entry.contains("t_junctions")) {
      const auto& times = entry.at("t_junctions");
      for (std::size_t i = 1; i + 1 < times.size(); ++i) {
        c.values["t" + std::to_string(i)] = std::stod(times.at(i).get<std::string>());
      }
    }
    if (entry.contains("states")) c.chain = disk_chain(entry, c.scene, c.structure);
    cases.push_back(std::move(c));
  }
  return cases;
}

}  // namespace costate::test
