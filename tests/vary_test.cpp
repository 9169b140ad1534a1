/// --vary in the process: what the flags mean, and how a scene is followed, on equations with known solutions.
#include "small_problems.hpp"

#include "common/branch_run.hpp"

#include <costate/error.hpp>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace costate::tools {
namespace {

using small::contains;
using small::thrown;

/// A command line with numbers of every kind.
struct Line {
  double size = 1.0;
  std::optional<double> slope{};
  double turn = 1.0, after = 0.0;
  CommandLine line{"costate-test", "A tool."};

  Line() {
    line.number("--size", size, {0.0, 10.0, "m"}, "Size");
    line.number_or("--slope", slope, {-1.0, 1.0, "rad"}, "free", "Slope");
    line.number("--turn", turn, {-6.0, 6.0, "rad", true}, "Turn");
    line.variation_flags();
    line.number("--after", after, {0.0, 1.0, ""}, "Not of the scene");
    line.solver_flags();
  }

  std::optional<int> parse(std::vector<std::string> words) {
    words.insert(words.begin(), "costate-test");
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    return line.parse(static_cast<int>(argv.size()), argv.data());
  }

  /// The message of a refusal; empty if the words are admissible.
  std::string refusal(const std::vector<std::string>& words) {
    testing::internal::CaptureStderr();
    const std::optional<int> status = parse(words);
    const std::string message = testing::internal::GetCapturedStderr();
    EXPECT_EQ(status.has_value(), !message.empty());
    EXPECT_EQ(status.value_or(exit_bad_input), exit_bad_input);
    return message;
  }
};

TEST(VaryFlags, WithoutThemThereIsNoVariation) {
  Line tool;
  ASSERT_FALSE(tool.parse({"--size", "2"}));
  EXPECT_FALSE(tool.line.variation());
}

TEST(VaryFlags, CountGivesEvenValuesWithBothEnds) {
  Line tool;
  ASSERT_FALSE(tool.parse({"--vary", "size=0.1:0.7:4"}));
  const Variation& variation = tool.line.variation().value();
  EXPECT_EQ(variation.name, "size");
  EXPECT_EQ(variation.unit, "m");
  EXPECT_EQ(variation.count, 4);
  ASSERT_EQ(variation.values.size(), 4u);
  EXPECT_EQ(variation.values.front(), 0.1);
  EXPECT_EQ(variation.values.back(), 0.7);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_DOUBLE_EQ(variation.values[i], 0.1 + 0.2 * static_cast<double>(i));
  EXPECT_EQ(tool.size, 0.1) << "the scene is that at the start";
  variation.store(0.5);
  EXPECT_EQ(tool.size, 0.5);
}

TEST(VaryFlags, FurtherValuesStandInOrderAndOnce) {
  Line tool;
  ASSERT_FALSE(tool.parse({"--vary", "size=3:1:3", "--at", "1.5,2.75,2,3"}));
  EXPECT_EQ(tool.line.variation()->values, (std::vector{3.0, 2.75, 2.0, 1.5, 1.0}));
}

TEST(VaryFlags, WithoutACountTheStepsAreShown) {
  Line tool;
  ASSERT_FALSE(tool.parse({"--vary", "size=0:1"}));
  EXPECT_TRUE(tool.line.variation()->values.empty());
  EXPECT_FALSE(tool.line.variation()->count);
}

TEST(VaryFlags, ANumberThatMayBeAWordIsVariedOverNumbers) {
  Line tool;
  ASSERT_FALSE(tool.parse({"--vary", "slope=-1:1:2"}));
  EXPECT_EQ(tool.line.variation()->unit, "rad");
  EXPECT_EQ(tool.slope, -1.0);
  EXPECT_TRUE(contains(Line().refusal({"--vary", "slope=free:1"}), "'free' is not a number"));
}

TEST(VaryFlags, RefusalsNameFlagValueAndRange) {
  const std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>> cases{
      {{"--vary", ""}, {"--vary ''", "size, slope, turn"}},
      {{"--vary", "after=0:1"}, {"'after=0:1'", "size, slope, turn"}},
      {{"--vary", "accuracy=1e-9:1e-8"}, {"accuracy", "size, slope, turn"}},
      {{"--vary", "--size=0:1"}, {"size, slope, turn"}},
      {{"--vary", "size"}, {"NAME=FROM:TO[:COUNT]", "0 … 10 m"}},
      {{"--vary", "size=1"}, {"NAME=FROM:TO[:COUNT]", "0 … 10 m"}},
      {{"--vary", "size=0:1:2:3"}, {"NAME=FROM:TO[:COUNT]"}},
      {{"--vary", "size=:1"}, {"--vary size ''", "0 … 10 m"}},
      {{"--vary", "size=0:"}, {"--vary size ''", "0 … 10 m"}},
      {{"--vary", "size=nan:1"}, {"--vary size nan", "0 … 10 m"}},
      {{"--vary", "size=0:inf"}, {"--vary size inf", "0 … 10 m"}},
      {{"--vary", "size=0:1e300"}, {"--vary size 1e300", "0 … 10 m"}},
      {{"--vary", "size=0:1e400"}, {"--vary size 1e400", "0 … 10 m"}},
      {{"--vary", "size=0:11"}, {"--vary size 11", "0 … 10 m"}},
      {{"--vary", "size=0:1,5"}, {"'1,5' is not a number"}},
      {{"--vary", "turn=0:1"}, {"--vary turn 0", "rad, not 0"}},
      {{"--vary", "turn=-1:1:3"}, {"--vary turn", "0 is among the values", "rad, not 0"}},
      {{"--vary", "turn=-1:1", "--at", "0"}, {"0 is among the values"}},
      {{"--vary", "size=1:1"}, {"must differ", "0 … 10 m"}},
      {{"--vary", "size=1:1.0"}, {"must differ"}},
      {{"--vary", "size=0:1:1"}, {"COUNT '1'", "2 … 10000"}},
      {{"--vary", "size=0:1:10001"}, {"COUNT '10001'", "2 … 10000"}},
      {{"--vary", "size=0:1:99999999999999"}, {"COUNT '99999999999999'"}},
      {{"--vary", "size=0:1:-3"}, {"COUNT '-3'"}},
      {{"--vary", "size=0:1:2.5"}, {"COUNT '2.5'"}},
      {{"--vary", "size=0:1:nan"}, {"COUNT 'nan'"}},
      {{"--vary", "size=0:1:"}, {"COUNT ''"}},
      {{"--vary", "size=0:1", "--size", "0.5"}, {"--vary size", "--size", "exclude"}},
      {{"--vary", "size=0:1", "--vary", "turn=1:2"}, {"--vary"}},
      {{"--vary"}, {"--vary"}},
      {{"--vary", "size=0:1", "--at", "2"}, {"--at 2", "0 … 1 m"}},
      {{"--vary", "size=0:1", "--at", "nan"}, {"--at nan", "0 … 1 m"}},
      {{"--vary", "size=0:1", "--at", ""}, {"--at ''"}},
      {{"--vary", "size=0:1", "--at", "0.5,,0.6"}, {"--at ''"}},
      {{"--at", "0.5"}, {"--at needs --vary"}},
  };
  for (const auto& [words, parts] : cases) {
    const std::string message = Line().refusal(words);
    EXPECT_FALSE(message.empty()) << words.back();
    for (const std::string& part : parts) EXPECT_TRUE(contains(message, part)) << part << " is not in " << message;
  }
}

using Rows = small::Equations::RowsOf;

std::shared_ptr<const Problem> equation(const Rows& rows, double p, Unknown unknown = {"y"}) {
  return std::make_shared<small::Equations>(std::vector{std::move(unknown)}, std::vector<Row>{{"row"}}, rows,
                                            std::vector<Parameter>{{"p", "m", p}});
}

/// y³ = p, T = y: dT/dp = p^{−2/3}/3.
std::vector<Jet> cubic(Shot& shot) {
  const Jet& y = shot.unknown(0);
  shot.report("final_time", "s", y);
  return {y * y * y - shot.parameter(0)};
}

/// The circle y² + p² = 1, T = y: a fold at p = 1.
std::vector<Jet> circle(Shot& shot) {
  const Jet &y = shot.unknown(0), &p = shot.parameter(0);
  shot.report("final_time", "s", y);
  return {y * y + p * p - 1.0};
}

Outcome solved(const std::shared_ptr<const Problem>& problem, double guess = 1.0) {
  Outcome outcome;
  outcome.solution = solve(problem, Eigen::VectorXd::Constant(1, guess), {});
  outcome.message = outcome.solution.message;
  outcome.status = outcome.solution.solved() ? Outcome::Status::solved : Outcome::Status::failed;
  return outcome;
}

/// A scene with the one number p.
struct Tool {
  double p = 0.0;
  std::function<Outcome(double)> solve;

  [[nodiscard]] VariedScene scene(double from, double to, std::vector<double> values = {}) {
    return {.variation = {.name = "p",
                          .unit = "m",
                          .from = from,
                          .to = to,
                          .values = std::move(values),
                          .store = [this](double v) { p = v; }},
            .heading = [] { return Heading{.model = "test", .title = "Test", .scene = {}, .unknowns = {}}; },
            .solve = [this] { return solve(p); }};
  }
};

const Quantity& time_of(const VariedPoint& point) { return find({&point.solution.reports}, "final_time"); }

/// JSON of a branch, which must be such and hold no number that is none.
nlohmann::json parsed(const VariedScene& scene, const VariedOutcome& outcome) {
  const std::string text = to_json(scene, outcome).dump();
  for (const char* none : {"nan", "inf\"", "inf,"}) EXPECT_FALSE(contains(text, none)) << none;
  return nlohmann::json::parse(text);
}

TEST(Vary, PointsAreSolvedByThemselvesWithExactDerivatives) {
  Tool tool{.solve = [](double p) { return solved(equation(cubic, p)); }};
  const VariedScene scene = tool.scene(1.0, 8.0, {1.0, 3.0, 8.0});
  const VariedOutcome outcome = follow_variation(scene);
  EXPECT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
  ASSERT_EQ(outcome.points.size(), 3u);
  for (const VariedPoint& point : outcome.points) {
    EXPECT_TRUE(point.requested);
    EXPECT_NEAR(time_of(point).value, std::cbrt(point.parameter), time_of(point).error_bound + 1e-15);
    // y″ = −2/9 p^{−5/3} < 1 turns the error of y into one of the derivative.
    EXPECT_NEAR(point.derivatives.at(0).derivative, std::pow(point.parameter, -2.0 / 3.0) / 3.0,
                time_of(point).error_bound + 1e-15);
  }
  const nlohmann::json json = parsed(scene, outcome);
  EXPECT_EQ(json.at("vary").at("from"), 1.0);
  EXPECT_EQ(json.at("vary").at("to"), 8.0);
  EXPECT_EQ(json.at("vary").at("unit"), "m");
  EXPECT_TRUE(json.at("vary").at("count").is_null()) << "no COUNT was given";
  EXPECT_EQ(json.at("points").at(1).at("parameter"), 3.0);
  EXPECT_EQ(json.at("status"), "solved");
}

TEST(Vary, EveryOfManyValuesHasItsPoint) {
  Tool tool{.solve = [](double p) { return solved(equation(cubic, p)); }};
  constexpr int count = 1500;
  std::vector<double> values;
  for (int i = 0; i <= count; ++i) values.push_back(1.0 + i * (1.0 / count));
  const VariedOutcome outcome = follow_variation(tool.scene(1.0, 2.0, values));
  EXPECT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
  ASSERT_EQ(outcome.points.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(outcome.points[i].parameter, values[i]);
  EXPECT_TRUE(outcome.events.empty());
}

// Two statements of T = p: the first ends at p = 1. Values lie closer behind its end than the second one starts.
TEST(Vary, TakenUpAgainInAnotherStatementItLosesNoValue) {
  const auto problem = [](double p) {
    return p < 1.0 ? equation(
                         [](Shot& shot) {
                           shot.report("final_time", "s", shot.unknown(0));
                           return std::vector{shot.unknown(0) - shot.parameter(0) +
                                              0.0 * sqrt(1.0 - shot.parameter(0), "room left")};
                         },
                         p)
                   : equation(
                         [](Shot& shot) {
                           shot.report("final_time", "s", 2.0 * shot.unknown(0));
                           return std::vector{2.0 * shot.unknown(0) - shot.parameter(0)};
                         },
                         p);
  };
  Tool tool{.solve = [&](double p) { return solved(problem(p)); }};
  const std::vector<double> values{0.0, 0.5, 1.00001, 1.00005, 1.00015, 1.5, 2.0};
  const VariedOutcome outcome = follow_variation(tool.scene(0.0, 2.0, values));
  EXPECT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
  ASSERT_EQ(outcome.events.size(), 1u);
  EXPECT_EQ(outcome.events[0].kind, "restart");
  ASSERT_EQ(outcome.points.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_EQ(outcome.points[i].parameter, values[i]);
    EXPECT_TRUE(outcome.points[i].requested);
    EXPECT_NEAR(time_of(outcome.points[i]).value, values[i], 1e-14);
  }
}

TEST(Vary, BranchThatTurnsBackKeepsWhatItHas) {
  Tool tool{.solve = [](double p) { return solved(equation(circle, p)); }};
  const VariedScene scene = tool.scene(0.0, 2.0, {0.0, 0.6, 2.0});
  const VariedOutcome outcome = follow_variation(scene);
  EXPECT_EQ(outcome.status, Outcome::Status::failed);
  ASSERT_EQ(outcome.events.size(), 1u);
  EXPECT_EQ(outcome.events[0].kind, "fold");
  EXPECT_NEAR(outcome.events[0].parameter, 1.0, outcome.events[0].error_bound + 1e-15);
  std::vector<double> times;
  for (const VariedPoint& point : outcome.points) {
    if (point.parameter == 0.6) times.push_back(time_of(point).value);
  }
  ASSERT_EQ(times.size(), 2u) << "on the way there and back";
  EXPECT_NEAR(times[0], 0.8, 1e-14);
  EXPECT_NEAR(times[1], -0.8, 1e-14);
  EXPECT_FALSE(outcome.message.empty());
  EXPECT_EQ(parsed(scene, outcome).at("events").size(), 1u);
}

// y runs away as 1/√(2 − p): nothing turns back there.
TEST(Vary, LimitAtWhichUnknownsRunAwayIsNoFold) {
  const Rows rows = [](Shot& shot) {
    const Jet& u = shot.unknown(0);
    shot.report("final_time", "s", exp(0.5 * u));
    return std::vector{log((2.0 - shot.parameter(0)) * exp(u))};
  };
  Tool tool{.solve = [&](double p) { return solved(equation(rows, p), 0.0); }};
  const VariedOutcome outcome = follow_variation(tool.scene(1.0, 3.0, {1.0, 1.5, 2.5, 3.0}));
  EXPECT_EQ(outcome.status, Outcome::Status::failed);
  for (const VariedEvent& event : outcome.events) EXPECT_NE(event.kind, "fold") << event.parameter;
  ASSERT_EQ(outcome.points.size(), 2u);
  EXPECT_NEAR(time_of(outcome.points[1]).value, std::sqrt(2.0), 1e-8);
}

// A root outside the domain of its unknown is none; the row says so, and the table, JSON and CSV hold it.
TEST(Vary, RefusedPointStaysWithItsReason) {
  const Unknown bounded{.name = "y", .upper = 1.5};
  Tool tool{.solve = [&](double p) { return solved(equation(cubic, p, bounded)); }};
  const VariedScene scene = tool.scene(1.0, 8.0, {1.0, 2.0, 5.0, 8.0});
  const VariedOutcome outcome = follow_variation(scene);
  EXPECT_EQ(outcome.status, Outcome::Status::failed);
  ASSERT_EQ(outcome.points.size(), 3u) << "two, and the first root that is no solution";
  EXPECT_TRUE(outcome.points[1].solution.solved());
  EXPECT_FALSE(outcome.points[2].solution.solved());
  EXPECT_GT(outcome.points[2].parameter, 3.375) << "y = 1.5 there";
  EXPECT_LT(outcome.points[2].parameter, 5.0) << "steps between the values shown are looked at, too";
  const nlohmann::json json = parsed(scene, outcome);
  EXPECT_EQ(json.at("points").back().at("status"), "refused");
  EXPECT_FALSE(json.at("points").back().at("message").get<std::string>().empty());
  EXPECT_TRUE(contains(csv_text(scene, outcome), "refused"));
  testing::internal::CaptureStdout();
  print_table(scene, outcome);
  std::fflush(stdout);
  EXPECT_TRUE(contains(testing::internal::GetCapturedStdout(), "refused: "));
}

TEST(Vary, NumbersThatDoNotGoTogetherEndTheBranchButNotItsOutput) {
  Tool tool{.solve = [](double p) {
    if (p > 1.0) throw BadInput("p is not admissible here");
    return solved(equation(circle, p));
  }};
  const VariedOutcome outcome = follow_variation(tool.scene(0.0, 3.0, {0.0, 0.5, 3.0}));
  EXPECT_EQ(outcome.status, Outcome::Status::failed);
  EXPECT_GE(outcome.points.size(), 2u);
  EXPECT_TRUE(contains(thrown<BadInput>([&] { (void)follow_variation(tool.scene(3.0, 1.0)); }), "not admissible"))
      << "at the start it is bad input";
}

TEST(Vary, StartWithoutASolutionIsTheScenesOwnAnswer) {
  Tool tool{.solve = [](double) {
    Outcome outcome;
    outcome.status = Outcome::Status::infeasible;
    outcome.message = "p is too large";
    return outcome;
  }};
  const VariedOutcome outcome = follow_variation(tool.scene(3.0, 1.0));
  EXPECT_EQ(outcome.status, Outcome::Status::infeasible);
  EXPECT_TRUE(contains(outcome.message, "at p = 3: p is too large")) << outcome.message;
  EXPECT_TRUE(outcome.points.empty());
}

Outcome in_closed_form(double p) {
  Outcome outcome;
  outcome.status = Outcome::Status::solved;
  outcome.closed_form = ClosedForm{.name = "line", .quantities = {{"final_time", "s", p, 1e-16}}, .trajectory = {}};
  return outcome;
}

TEST(Vary, ClosedFormsAllAlongAreListed) {
  Tool tool{.solve = in_closed_form};
  const VariedScene asked = tool.scene(1.0, 2.0, {1.0, 1.25, 2.0});
  const VariedOutcome outcome = follow_variation(asked);
  EXPECT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
  ASSERT_EQ(outcome.points.size(), 3u);
  const nlohmann::json json = parsed(asked, outcome);
  EXPECT_EQ(json.at("points").at(1).at("quantities").at("final_time").at("value"), 1.25);
  EXPECT_TRUE(json.at("points").at(1).at("quantities").at("final_time").at("derivative").is_null());
  testing::internal::CaptureStdout();
  print_table(asked, outcome);
  std::fflush(stdout);
  const std::string table = testing::internal::GetCapturedStdout();
  EXPECT_FALSE(contains(table, "nan")) << table;
  const VariedOutcome steps = follow_variation(tool.scene(1.0, 2.0));
  EXPECT_EQ(steps.status, Outcome::Status::solved);
  EXPECT_EQ(steps.points.back().parameter, 2.0);
  EXPECT_GT(steps.points.size(), 10u);
}

TEST(Vary, ClosedFormAtTheStartIsARowOfItsOwn) {
  Tool tool{.solve = [](double p) { return p == 1.0 ? in_closed_form(1.0) : solved(equation(cubic, p)); }};
  const VariedOutcome outcome = follow_variation(tool.scene(1.0, 2.0, {1.0, 1.0001, 1.5, 2.0}));
  EXPECT_EQ(outcome.status, Outcome::Status::solved) << outcome.message;
  ASSERT_EQ(outcome.points.size(), 4u);
  EXPECT_TRUE(outcome.points[0].closed_form);
  EXPECT_EQ(outcome.points[1].parameter, 1.0001) << "values closer to the start than the branch's own start count";
  EXPECT_NEAR(time_of(outcome.points[3]).value, std::cbrt(2.0), 1e-14);
}

TEST(Vary, ObjectionsAreQuotedInCsv) {
  Tool tool{.solve = [](double p) { return solved(equation(cubic, p)); }};
  VariedScene scene = tool.scene(1.0, 2.0, {1.0, 2.0});
  scene.judge = [](const Solution&) { return std::string("a, \"b\""); };
  const VariedOutcome outcome = follow_variation(scene);
  EXPECT_TRUE(contains(csv_text(scene, outcome), R"(,"a, ""b""",)")) << csv_text(scene, outcome);
  scene.judge = [](const Solution&) -> std::string { throw LeftDomain("blown up"); };
  EXPECT_TRUE(contains(follow_variation(scene).points.at(0).objection, "blown up")) << "the output is kept";
}

}  // namespace
}  // namespace costate::tools
