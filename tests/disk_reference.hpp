/// \file
/// The reference cases of the rolling disk: 18–20 digits, computed with elliptic functions and multiple-precision Taylor series.
#pragma once

#include <costate/models/disk.hpp>

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
};

/// How test failures name a case.
inline void PrintTo(const DiskCase& c, std::ostream* out) { *out << c.name; }

inline double reference_number(const std::string& text) {
  if (text == "sqrt6") return std::sqrt(6.0);
  if (text == "pi/2") return std::numbers::pi / 2;
  if (text == "pi/4") return std::numbers::pi / 4;
  return std::stod(text);
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
    cases.push_back(std::move(c));
  }
  return cases;
}

}  // namespace costate::test
