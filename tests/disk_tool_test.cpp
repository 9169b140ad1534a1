/// The contract of costate-disk on its command line: exit statuses, what stands on which stream, JSON, CSV, and every bad input.
#include "run_tool.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cctype>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <numbers>

namespace costate::tools {
namespace {

class Tool : public ToolTest {
 protected:
  Tool() : ToolTest(COSTATE_TOOL) {}
};

TEST_F(Tool, BadInputIsStatusTwoAndSaysWhatIsAdmissible) {
  const std::string missing = (folder() / "missing" / "a.csv").string();
  const std::vector<BadInput> cases{
      {{"--radius", "-1"}, {"--radius", "-1", "1e-06", "1e+06", "m"}},
      {{"--radius=-1"}, {"--radius", "-1", "1e-06", "1e+06", "m"}},
      {{"--radius", "0"}, {"--radius", "0", "1e-06"}},
      {{"--friction", "0"}, {"--friction", "0", "1e-09", "1e+06"}},
      {{"--friction", "-0.1"}, {"--friction", "-0.1", "1e-09"}},
      {{"--x", "nan"}, {"--x", "nan", "-1e+06", "1e+06", "m"}},
      {{"--x", "-inf"}, {"--x", "-inf", "-1e+06", "1e+06", "m"}},
      {{"--x", ""}, {"--x", "''", "-1e+06", "1e+06", "m"}},
      {{"--x="}, {"--x", "-1e+06", "1e+06", "m"}},
      {{"--x"}, {"--x", "-1e+06", "1e+06", "m"}},
      {{"--x", "1e400"}, {"--x", "1e400", "-1e+06", "1e+06"}},
      {{"--x", "1e300"}, {"--x", "1e300", "-1e+06", "1e+06"}},
      {{"--x", "1,5"}, {"--x", "1,5", "not a number"}},
      {{"--x", "1m"}, {"--x", "1m", "not a number"}},
      {{"--x", "0x10"}, {"--x", "0x10", "not a number"}},
      {{"--heading", "0"}, {"--heading", "0", "rad", "not 0"}},
      {{"--heading", "6.3"}, {"--heading", "6.3", "-6.28319", "6.28319", "rad"}},
      {{"--speed", "0"}, {"--speed", "0", "1e-06", "m/s"}},
      {{"--gravity", "-9.81"}, {"--gravity", "-9.81", "1e-06", "m/s^2"}},
      {{"--accuracy", "1e-30"}, {"--accuracy", "1e-30", "1e-12", "0.001"}},
      {{"--accuracy", "0.1"}, {"--accuracy", "0.1", "1e-12", "0.001"}},
      {{"--accuracy", "nan"}, {"--accuracy", "nan", "1e-12"}},
      {{"--x", "1", "--x", "2"}, {"--x", "1", "2", "-1e+06"}},
      {{"--bogus"}, {"--bogus"}},
      {{"--bogus", "3"}, {"--bogus"}},
      {{"stray"}, {"stray"}},
      {{"--csv", missing}, {"--csv", missing}},
      {{"--csv", ""}, {"--csv", "''"}},
      {{"--csv", folder().string()}, {"--csv", folder().string()}},
      {{"--csv", "a.csv", "--json"}, {"--csv", "--json"}},
  };
  expect_refusals(cases);
}

TEST_F(Tool, SceneWithTooLittleFrictionIsStatusThree) {
  const Ended got = run({"--friction", "0.03"});
  EXPECT_EQ(got.status, 3);
  EXPECT_EQ(got.out, "");
  EXPECT_TRUE(contains(got.err, "k_min = 0.05098581")) << got.err;
  EXPECT_TRUE(contains(got.err, "0.03")) << got.err;
}

TEST_F(Tool, SceneOutOfReachIsStatusFourInTime) {
  const auto began = std::chrono::steady_clock::now();
  const Ended got = run({"--x", "1e6", "--y", "1e6"});
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  EXPECT_EQ(got.status, 4);
  EXPECT_EQ(got.out, "");
  EXPECT_TRUE(contains(got.err, "; try ")) << got.err;
  EXPECT_LT(took.count(), 10.0);
}

const Arguments json_keys{"schema",  "model",  "scene", "engine", "status",      "structure", "final_time", "switching_times",
                          "unknowns", "limits", "error_bound", "certificate", "cost",      "message"};

TEST_F(Tool, JsonHasTheSameKeysWhateverBecameOfTheScene) {
  struct Case {
    Arguments arguments;
    int status;
    const char* word;
  };
  for (const Case& c : {Case{{}, 0, "solved"}, Case{{"--friction", "0.03"}, 3, "infeasible"},
                        Case{{"--x", "100", "--y", "100"}, 4, "failed"}}) {
    Arguments arguments = c.arguments;
    arguments.push_back("--json");
    const Ended got = run(arguments);
    EXPECT_EQ(got.status, c.status);
    const json result = json::parse(got.out);
    ASSERT_EQ(result.size(), json_keys.size()) << got.out;
    for (const std::string& key : json_keys) EXPECT_TRUE(result.contains(key)) << key;
    EXPECT_EQ(result["schema"], "costate/1");
    EXPECT_EQ(result["model"], "disk");
    EXPECT_EQ(result["status"], c.word);
    for (const char* key : {"x", "y", "heading", "radius", "speed", "gravity", "friction"}) {
      EXPECT_TRUE(result["scene"].contains(key)) << key;
    }
    for (const char* key : {"seconds", "steps", "rhs_evaluations", "newton_iterations"}) {
      EXPECT_TRUE(result["cost"][key].is_number()) << key;
    }
    EXPECT_EQ(result["message"].get<std::string>().empty(), c.status == 0);
    EXPECT_EQ(result["final_time"].is_null(), c.status != 0);
    EXPECT_EQ(result["structure"].empty(), c.status != 0);
  }
}

TEST_F(Tool, CostIsThatOfTheWorkDoneAlsoWhenItWasInVain) {
  const Ended got = run({"--x", "100", "--y", "100", "--json"});
  ASSERT_EQ(got.status, 4);
  const json cost = json::parse(got.out)["cost"];
  EXPECT_GT(cost["newton_iterations"], 0);
  EXPECT_GT(cost["steps"], 0);
  EXPECT_GT(cost["rhs_evaluations"], 0);
}

/// Value within the accuracy of the reference, and its error bound within what was asked.
void expect_quantity(const json& result, const std::string& name, double reference, double accuracy) {
  EXPECT_NEAR(result["unknowns"][name].get<double>(), reference, accuracy) << name;
  EXPECT_LE(result["error_bound"][name].get<double>(), 1e-10) << name;
}

// References: an independent solution by elliptic integrals in 50 digits.
TEST_F(Tool, DefaultSceneHasTheReferenceValues) {
  const json result = solved_json({"--accuracy", "1e-10"});
  EXPECT_EQ(result["structure"], json::array({"free"}));
  EXPECT_NEAR(result["final_time"].get<double>(), 2.2117064716698363, 1e-10);
  EXPECT_TRUE(result["switching_times"].empty());
  expect_quantity(result, "lambda_x", 0.5438946646989734, 1e-10);
  expect_quantity(result, "lambda_y", 0.5438946646989734, 1e-10);
  EXPECT_NEAR(result["limits"]["F_max"].get<double>(), 0.065818886430517, 1e-9);
  EXPECT_NEAR(result["limits"]["F_min"].get<double>(), 0.050122095872426, 1e-9);
  EXPECT_NEAR(result["limits"]["k_min"].get<double>(), 0.05098581, 1e-8);
  EXPECT_EQ(result["certificate"]["verdict"], "extremal");
  for (const json& check : result["certificate"]["checks"]) EXPECT_EQ(check["tolerance"], 1e-11) << "far below what was asked";
  EXPECT_TRUE(result["scene"]["friction"].is_null());
}

TEST_F(Tool, LimitedFrictionHasTheReferenceValues) {
  const json result = solved_json({"--friction", "0.0525", "--accuracy", "1e-10"});
  EXPECT_EQ(result["structure"], json::array({"saturated", "free", "saturated"}));
  EXPECT_NEAR(result["final_time"].get<double>(), 2.2133252145652510, 1e-9);
  ASSERT_EQ(result["switching_times"].size(), 2U);
  EXPECT_NEAR(result["switching_times"][0].get<double>(), 1.0855647258861120, 1e-9);
  EXPECT_NEAR(result["switching_times"][1].get<double>(), 1.1277604886791390, 1e-9);
  EXPECT_EQ(result["error_bound"]["switching_times"].size(), 2U);
  expect_quantity(result, "V0", 0.6264993384592928, 1e-9);
  expect_quantity(result, "lambda_x", 0.5468011525749507, 1e-9);
  expect_quantity(result, "lambda_y", 0.5468011525749507, 1e-9);
  EXPECT_EQ(result["scene"]["friction"], 0.0525);
  for (const json& check : result["certificate"]["checks"]) EXPECT_TRUE(check["holds"].get<bool>()) << check;
}

TEST_F(Tool, FrictionThatNeverBindsChangesNothing) {
  json with = solved_json({"--friction", "0.066"}), without = solved_json({});
  for (json* result : {&with, &without}) {
    (*result)["cost"].erase("seconds");
    (*result)["scene"].erase("friction");
  }
  EXPECT_EQ(with, without);
}

// The mirror image in the x axis: heading, y, and with them λy, λφ and Ω change sign.
TEST_F(Tool, MirroredSceneHasTheMirroredSolution) {
  for (const Arguments& friction : {Arguments{}, Arguments{"--friction", "0.0525"}}) {
    Arguments left{"--heading", "1.5707963267948966", "--y", "1"}, right{"--heading", "-1.5707963267948966", "--y", "-1"};
    for (Arguments* arguments : {&left, &right}) arguments->insert(arguments->end(), friction.begin(), friction.end());
    const json a = solved_json(left), b = solved_json(right);
    EXPECT_EQ(a["structure"], b["structure"]);
    // Each of the two may err by the default accuracy.
    const auto expect_equal = [](const json& left_value, const json& right_value, double sign, const char* name) {
      EXPECT_NEAR(left_value[name].get<double>(), sign * right_value[name].get<double>(), 2e-8) << name;
    };
    expect_equal(a, b, 1.0, "final_time");
    for (const char* same : {"lambda_x", "V0"}) expect_equal(a["unknowns"], b["unknowns"], 1.0, same);
    for (const char* negated : {"lambda_y", "lambda_phi0", "Omega0"}) expect_equal(a["unknowns"], b["unknowns"], -1.0, negated);
    for (const char* limit : {"F_max", "F_min", "k_min"}) expect_equal(a["limits"], b["limits"], 1.0, limit);
  }
}

TEST_F(Tool, TableIsForPeople) {
  const Ended got = run({});
  EXPECT_EQ(got.status, 0);
  EXPECT_EQ(got.err, "");
  for (const char* word : {"solved", "free", "final_time", "2.21170647", "lambda_x", "s/m", "error bound", "F_max"}) {
    EXPECT_TRUE(contains(got.out, word)) << word << "\n" << got.out;
  }
}

TEST_F(Tool, QuietPrintsNothing) {
  for (const auto& [arguments, status] : {std::pair{Arguments{"--quiet"}, 0}, {{"--quiet", "--friction", "0.03"}, 3}}) {
    const Ended got = run(arguments);
    EXPECT_EQ(got.status, status);
    EXPECT_EQ(got.out, "");
    EXPECT_EQ(got.err.empty(), status == 0) << "a failure is still explained";
  }
}

TEST_F(Tool, HelpNamesEveryFlagWithUnitAndDefault) {
  const Ended got = run({"--help"});
  EXPECT_EQ(got.status, 0);
  EXPECT_EQ(got.err, "");
  // What stands on the line of each flag: unit, default.
  const std::vector<Arguments> flags{
      {"--x ", " m ", "[1]"},           {"--y ", " m ", "[1]"},        {"--heading ", " rad ", "[1.57079632679]"},
      {"--radius ", " m ", "[2.44948974278]"}, {"--speed ", " m/s ", "[1]"}, {"--gravity ", " m/s^2 ", "[9.80665]"},
      {"--friction ", "unlimited"},     {"--accuracy ", "[1e-08]"},    {"--json "},
      {"--csv ", "FILE"},               {"--quiet "},                  {"--help "},
      {"--version "}};
  for (const Arguments& flag : flags) {
    const auto begin = got.out.find("  " + flag[0]);
    ASSERT_NE(begin, std::string::npos) << flag[0];
    const std::string line = got.out.substr(begin, got.out.find("\n  -", begin + 1) - begin);
    for (const std::string& part : flag) EXPECT_TRUE(contains(line, part)) << part << " is not in " << line;
  }
}

TEST_F(Tool, VersionIsOneLine) {
  const Ended got = run({"--version"});
  EXPECT_EQ(got.status, 0);
  EXPECT_EQ(got.out.find("costate-disk "), 0U) << got.out;
  EXPECT_TRUE(got.out.size() > 14 && std::isdigit(static_cast<unsigned char>(got.out[13])) != 0) << got.out;
  EXPECT_EQ(std::count(got.out.begin(), got.out.end(), '\n'), 1);
}

TEST_F(Tool, OutputThatCannotBeWrittenIsStatusFour) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  for (const Arguments& arguments :
       {Arguments{}, Arguments{"--json"}, Arguments{"--json", "--friction", "0.03"}, Arguments{"--csv", "-"}}) {
    const Ended got = run(arguments, "/dev/full");
    EXPECT_EQ(got.status, 4) << fmt::format("{}", fmt::join(arguments, " "));
    EXPECT_TRUE(contains(got.err, "written") || contains(got.err, "No space left")) << got.err;
  }
}

TEST_F(Tool, OutputThatCannotBeWrittenIsNotCalledADefect) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const Ended got = run({"--csv", "-"}, "/dev/full");
  EXPECT_FALSE(contains(got.err, "unexpected") || contains(got.err, "report")) << got.err;
}

TEST_F(Tool, HelpThatCannotBeWrittenIsStatusFourToo) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  for (const char* flag : {"--help", "--version"}) {
    const Ended got = run({flag}, "/dev/full");
    EXPECT_EQ(got.status, 4) << flag;
    EXPECT_FALSE(got.err.empty()) << flag;
  }
}

/// A table of the trajectory: one row a point, cells as text.
struct Table {
  Arguments header;
  std::vector<Arguments> rows;
  explicit Table(const std::string& text) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      Arguments cells;
      std::istringstream words(line);
      for (std::string word; std::getline(words, word, ',');) cells.push_back(word);
      (header.empty() ? header : rows.emplace_back()) = cells;
    }
  }
  [[nodiscard]] double number(std::size_t row, const std::string& column) const {
    const auto at = std::find_if(header.begin(), header.end(), [&](const std::string& h) { return h.find(column + " [") == 0; });
    if (at == header.end()) return std::nan("");
    return std::stod(rows.at(row).at(static_cast<std::size_t>(at - header.begin())));
  }
};

void expect_trajectory(const Table& table, std::vector<std::string> structure, double final_time, double accuracy) {
  ASSERT_GT(table.rows.size(), 100U);
  EXPECT_EQ(table.header[0], "t [s]");
  EXPECT_EQ(table.header[1], "arc");
  for (std::size_t i = 2; i < table.header.size(); ++i) {
    EXPECT_TRUE(contains(table.header[i], " [") && table.header[i].back() == ']') << table.header[i];
  }
  for (const char* column : {"x", "y", "phi"}) EXPECT_NEAR(table.number(0, column), 0.0, accuracy) << column;
  EXPECT_EQ(table.number(0, "t"), 0.0);
  const std::size_t last = table.rows.size() - 1;
  EXPECT_NEAR(table.number(last, "t"), final_time, accuracy);
  EXPECT_NEAR(table.number(last, "x"), 1.0, accuracy);
  EXPECT_NEAR(table.number(last, "y"), 1.0, accuracy);
  EXPECT_NEAR(table.number(last, "phi"), std::numbers::pi / 2, accuracy);

  std::vector<std::string> arcs{table.rows[0][1]};
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    ASSERT_EQ(table.rows[i].size(), table.header.size()) << "row " << i;
    for (std::size_t j = 0; j < table.header.size(); ++j) {
      if (j != 1) {
        EXPECT_TRUE(std::isfinite(std::stod(table.rows[i][j]))) << "row " << i << ", " << table.header[j];
      }
    }
    if (i == 0) continue;
    const double step = table.number(i, "t") - table.number(i - 1, "t");
    if (table.rows[i][1] == table.rows[i - 1][1]) {
      EXPECT_GT(step, 0.0) << "row " << i;
    } else {
      // A junction stands twice, at the end of one arc and the start of the next; the place is the same.
      arcs.push_back(table.rows[i][1]);
      EXPECT_EQ(step, 0.0) << "row " << i;
      for (const char* column : {"x", "y", "phi", "V"}) {
        EXPECT_NEAR(table.number(i, column), table.number(i - 1, column), accuracy) << column;
      }
    }
  }
  EXPECT_EQ(arcs, structure);
}

TEST_F(Tool, CsvIsTheTrajectory) {
  const fs::path file = folder() / "disk.csv";
  const Ended got = run({"--csv", file.string()});
  EXPECT_EQ(got.status, 0) << got.err;
  EXPECT_TRUE(contains(got.out, "final_time")) << "the table as well";
  expect_trajectory(Table(contents(file)), {"free"}, 2.2117064716698363, 1e-8);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder()), {}), 1) << "nothing but the file";

  EXPECT_EQ(run({"--csv", file.string(), "--friction", "0.0525", "--quiet"}).out, "");
  expect_trajectory(Table(contents(file)), {"saturated", "free", "saturated"}, 2.2133252145652510, 1e-8);
}

TEST_F(Tool, CsvToStandardOutputIsTheOnlyThingThere) {
  const Ended got = run({"--csv", "-", "--friction", "0.0525"});
  EXPECT_EQ(got.status, 0);
  EXPECT_EQ(got.err, "");
  expect_trajectory(Table(got.out), {"saturated", "free", "saturated"}, 2.2133252145652510, 1e-8);
}

TEST_F(Tool, CsvSurvivesEveryRunThatDoesNotSolve) {
  const fs::path file = folder() / "kept.csv";
  std::ofstream(file) << "precious\n";
  for (const auto& [arguments, status] :
       {std::pair{Arguments{"--radius", "-1"}, 2}, {{"--json"}, 2}, {{"--bogus"}, 2}, {{"--friction", "0.03"}, 3},
        {{"--x", "100", "--y", "100"}, 4}}) {
    Arguments all = arguments;
    all.insert(all.end(), {"--csv", file.string()});
    EXPECT_EQ(run(all).status, status);
    EXPECT_EQ(contents(file), "precious\n");
    EXPECT_EQ(std::distance(fs::directory_iterator(folder()), {}), 1) << "no partial file";
  }
}

}  // namespace
}  // namespace costate::tools
