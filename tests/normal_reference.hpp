/// \file
/// The reference cases of the bead with normal-force friction: long-double collocation, 15–16 digits.
#pragma once

#include <costate/models/normal_friction.hpp>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <ostream>
#include <string>

namespace costate::test {

struct NormalCase {
  std::string name;
  normal_friction::Scene scene;
  std::map<std::string, double> values;  ///< by the names of the problem's reports
};

/// How test failures name a case.
inline void PrintTo(const NormalCase& c, std::ostream* out) { *out << c.name; }

inline std::vector<NormalCase> normal_cases() {
  std::ifstream file(std::string(COSTATE_REFERENCE_DIR) + "/nonlinear_friction.json");
  const auto data = nlohmann::json::parse(file);
  std::vector<NormalCase> cases;
  for (const auto& entry : data.at("cases")) {
    if (entry.at("model") != "A") continue;
    const auto& params = entry.at("params");
    NormalCase c{entry.at("id"), {params.at("a"), params.at("b"), params.at("v0"), params.at("mu"), params.at("beta"), params.at("g")}, {}};
    const std::pair<const char*, const char*> fields[] = {{"T", "final_time"}, {"theta1", "theta1"}, {"theta2", "theta2"}, {"lx", "lambda_x"},
                                                          {"ly", "lambda_y"},  {"lv0", "lambda_v0"}, {"vf", "v_f"}};
    for (const auto& [key, report] : fields) c.values[report] = entry.at("solution").at(key);
    cases.push_back(std::move(c));
  }
  return cases;
}

}  // namespace costate::test
