// The gallery's programs as their users run them, against closed forms, published digits and collocation; the README against them.
#include "bvp_reference.hpp"
#include "run_tool.hpp"

#include <costate/implicit.hpp>

#include <cmath>
#include <map>
#include <regex>
#include <set>

namespace costate::tools {
namespace {

constexpr double pi = std::numbers::pi;
const fs::path sources = COSTATE_GALLERY_SOURCES, programs = COSTATE_GALLERY_PROGRAMS;

struct Printed {
  double value = 0.0, bound = 0.0;
};

/// The n-th line of a quantity in what a program printed: "name  value  +- bound".
Printed quantity(const std::string& text, const std::string& name, int n) {
  const std::regex line("^(.*?) +(\\S+)  \\+- (\\S+)");
  std::istringstream lines(text);
  for (std::string at; std::getline(lines, at);) {
    std::smatch match;
    if (std::regex_search(at, match, line) && match[1] == name && n-- == 0)
      return {std::stod(match[2]), std::stod(match[3])};
  }
  throw std::runtime_error(name + " is not in\n" + text);
}

/// What a quantity must be, and how far that itself is known. `which` of the lines that show it, from 0.
struct Expected {
  std::string name;
  double value = 0.0;
  double known = 0.0;  ///< absolute; 0: a closed form, to rounding
  int which = 0;
};

struct Case {
  std::string program;
  std::function<std::vector<Expected>()> expected;
};

void PrintTo(const Case& which, std::ostream* out) { *out << which.program; }

/// The root of a function of one number that has different signs at the ends.
template <class F>
double root(const F& f, double lower, double upper) {
  return guarded_root([&f](const auto& x, const auto&) { return f(x); }, std::array<double, 0>{}, lower, upper);
}

std::vector<Expected> bounded_energy() {
  const double p = std::sqrt(500.0 / 3.0), t1 = 0.5 - 5.0 / p;
  return {{"lambda_x", p}, {"lambda_v", 0.5 * p}, {"t1", t1}, {"t2", 1.0 - t1}, {"cost", 25.0 * t1 + 125.0 / (3.0 * p)}};
}

std::vector<Expected> bryson_denham() {
  // On [0, ½] the cubic from (0, 1) to (l, 0), u = a + b t, then its mirror image.
  const double l = 0.2, a = 24.0 * l - 8.0, b = 24.0 - 96.0 * l;
  return {{"t1", 1.0 / 3.0},
          {"t2", 2.0 / 3.0},
          {"lambda_x", -18.0},
          {"multiplier of ceiling at t1", 36.0},
          {"second multiplier of ceiling at t1", 6.0},
          {"cost", 4.0},
          {.name = "t1", .value = 0.5, .which = 1},
          {.name = "lambda_x", .value = -b, .which = 1},
          {.name = "multiplier of ceiling at t1", .value = 2.0 * b, .which = 1},
          {.name = "cost", .value = 0.5 * (a * a + a * b / 2.0 + b * b / 12.0), .which = 1}};
}

/// tan u = τ(1 − 2t/T): vx(T) = a T arsinh(τ)/τ, y(T) = a T² (τ√(1 + τ²) − arsinh τ)/(4τ²).
std::vector<Expected> linear_tangent() {
  constexpr double a = 100.0, speed = 45.0, height = 5.0;
  const auto arsinh = [](const auto& x) { return log(x + sqrt(1.0 + x * x)); };
  const auto rise = [&](const auto& tau) {
    const auto ratio = tau / arsinh(tau);  // T = speed/a times this
    return speed * speed / (4.0 * a) * ratio * ratio * (tau * sqrt(1.0 + tau * tau) - arsinh(tau)) / (tau * tau) - height;
  };
  const double tau = root(rise, 0.1, 10.0), time = speed / a * tau / std::asinh(tau);
  return {{"final_time", time}, {"cost", time}, {"final_time", 0.554570878334603, 5e-16}};
}

/// With H = 0 on the way to rest, λ = x³ − x√(x⁴ + 1), and away from it x³ + x√(x⁴ + 1). The stay leaves an error of e^−50.
std::vector<Expected> hypersensitive() {
  const auto g = [](double x) { return 0.25 * (x * x * std::sqrt(x * x * x * x + 1.0) + std::asinh(x * x)); };
  const double start = 1.5, end = 1.0, power = std::pow(start, 4);
  return {{"lambda_x", std::pow(start, 3) - start * std::sqrt(power + 1.0)},
          {"cost", g(start) - 0.25 * power + g(end) + 0.25 * std::pow(end, 4)}};
}

/// With 2 sinh(μy/2) = s sinh w the first integral is μ = ∫ dw/√(1 + s² sinh² w/4), here by Simpson's rule.
std::vector<Expected> troesch() {
  constexpr long double mu = 9.0L;
  const auto length = [](long double s) {
    constexpr int cells = 4000;
    const long double h = std::asinh(2.0L * std::sinh(0.5L * mu) / s) / cells;
    long double sum = 0.0L;
    for (int i = 0; i <= cells; ++i) {
      const long double sh = 0.5L * s * std::sinh(h * i);
      sum += (i == 0 || i == cells ? 1.0L : i % 2 == 0 ? 2.0L : 4.0L) / std::sqrt(1.0L + sh * sh);
    }
    return sum * h / 3.0L;
  };
  long double low = 1e-6L, high = 1.0L;
  for (int i = 0; i < 80; ++i) {
    const long double middle = std::sqrt(low * high);
    (length(middle) > mu ? low : high) = middle;
  }
  const auto slope = static_cast<double>(low);
  return {{"y'(0)", slope}, {"y'(1)", std::hypot(slope, 2.0 * std::sinh(4.5))}};
}

std::vector<Expected> swirling_flow() {
  using P = bvp::Problem33;
  const bvp::Known known = bvp::known<P>({0.1, 0.03, 0.01, 3e-3, 1e-3});
  std::vector<Expected> all;
  for (const std::size_t i : {1U, 4U, 5U}) {
    all.push_back({std::string(P::names[i]) + "(0)", known.start[i], 2.0 * known.error * std::abs(known.start[i])});
    all.push_back({std::string(P::names[i]) + "(1)", known.end[i], 2.0 * known.error * std::abs(known.end[i])});
  }
  return all;
}

std::vector<Expected> bratu() {
  const auto lambda = [](const auto& theta) { return theta * theta / (2.0 * cosh(0.25 * theta) * cosh(0.25 * theta)); };
  const double fold = root([](const auto& theta) { return 0.25 * theta * tanh(0.25 * theta) - 1.0; }, 1.0, 10.0);
  const auto at_one = [&](const auto& theta) { return lambda(theta) - 1.0; };
  const auto slope = [](double theta) { return theta * std::tanh(0.25 * theta); };
  const double lower = slope(root(at_one, 0.1, fold)), upper = slope(root(at_one, fold, 20.0));
  return {{"lambda at the fold", lambda(fold)},
          {"lambda at the fold", 3.51383071912516, 5e-15},
          {"y'(0)", lower},
          {"y'(1)", -lower},
          {.name = "y'(0)", .value = upper, .which = 1},
          {.name = "y'(1)", .value = -upper, .which = 1}};
}

/// The swings of n = 2, n = 3 and rest; either of two has the same cost.
std::vector<Expected> pendulum() {
  constexpr double T = 10.0;
  std::vector<Expected> all;
  for (const int n : {2, 3}) {
    double low = 0.0, high = 1.0 - 1e-12;
    for (int i = 0; i < 100; ++i) {
      const double k = 0.5 * (low + high);
      (std::comp_ellint_1(k) < T / (2.0 * n) ? low : high) = k;
    }
    const double cost = 8.0 * n * std::comp_ellint_2(low) - (3.0 - 2.0 * low * low) * T;
    for (const int twin : {0, 1}) all.push_back({.name = "cost", .value = cost, .which = 2 * n - 4 + twin});
  }
  all.push_back({.name = "cost", .value = T, .which = 4});
  all.push_back({.name = "lambda_x", .value = 0.0, .which = 4});
  return all;
}

std::vector<Expected> composite_fin() {
  // θ = C cosh(v (1 − x)) with θ(0.7) = ½, and θ = A cosh(w (0.4 − x)) + B sinh(w (0.4 − x)) before the joint.
  const auto joint = [](const auto& h) {
    const auto v = sqrt(h / 5.0), c = 0.5 / cosh(0.3 * v);
    return std::array{c * cosh(0.6 * v), 5.0 * v * c * sinh(0.6 * v)};
  };
  const auto hot_end = [&](const auto& h) {
    const auto w = sqrt(h);
    const auto at = joint(h);
    return at[0] * cosh(0.4 * w) + at[1] / w * sinh(0.4 * w) - 1.0;
  };
  const double h = root(hot_end, 0.1, 10.0), w = std::sqrt(h);
  const auto at = joint(h);
  return {{"h", h},
          {"theta(0.4)", at[0]},
          {"q(0.4)", at[1]},
          {"q(0)", w * at[0] * std::sinh(0.4 * w) + at[1] * std::cosh(0.4 * w)},
          {"theta(1)", 0.5 / std::cosh(0.3 * std::sqrt(h / 5.0))}};
}

const std::vector<Case> cases{
    {"bounded_energy", bounded_energy},
    {"bratu", bratu},
    {"bryson_denham", bryson_denham},
    {"composite_fin", composite_fin},
    {"double_integrator_energy",
     [] {
       return std::vector<Expected>{{"lambda_x", 12.0}, {"lambda_v", 6.0}, {"cost", 6.0}};
     }},
    {"double_integrator_time",
     [] {
       return std::vector<Expected>{{"lambda_x", 1.0}, {"t1", 1.0}, {"final_time", 2.0}, {"cost", 2.0}};
     }},
    {"goddard",
     [] {  // as published, to half a unit of the last digit
       return std::vector<Expected>{{"lambda_r", 3.9457646587, 5e-11},
                                    {"lambda_v", 0.15039559623, 5e-12},
                                    {"lambda_m", 0.05371271294, 5e-12},
                                    {"final_time", 0.20204744057148, 5e-15},
                                    {"cost", -1.0125763246569, 5e-14}};
     }},
    {"hypersensitive", hypersensitive},
    {"linear_tangent", linear_tangent},
    {"orbit_transfer",
     [] {  // an extrapolated midpoint rule with 22 digits; 64 and 128 steps differ by less than 1e-13
       return std::vector<Expected>{{"lambda_r", 5.271438449262256, 1e-13},
                                    {"lambda_v", 2.608954069489046, 1e-13},
                                    {"lambda_w", 5.685493613043995, 1e-13},
                                    {"final_time", 3.319308449674291, 1e-13}};
     }},
    {"pendulum", pendulum},
    {"swirling_flow", swirling_flow},
    {"troesch", troesch},
    {"turnpike",
     [] {
       return std::vector<Expected>{{"lambda_x", -1.0}, {"t1", 1.0}, {"t2", 1.5}, {"cost", 0.375}};
     }},
    {"van_der_pol",
     [] {  // an extrapolated midpoint rule with 22 digits, stopped at t1
       return std::vector<Expected>{{"lambda_x", 0.989821372704576, 1e-13},
                                    {"lambda_y", -4.388963253692249, 1e-13},
                                    {"t1", 0.882453426827969, 1e-13},
                                    {"cost", 1.822510195759220, 1e-13}};
     }},
};

/// The page that shows a failure.
const std::string failing = "wrong_structure";

class GalleryProgram : public ToolTest {
 protected:
  explicit GalleryProgram(const std::string& name) : ToolTest((programs / ("gallery_" + name)).string()) {}
};
class Gallery : public GalleryProgram, public testing::WithParamInterface<Case> {
 protected:
  Gallery() : GalleryProgram(GetParam().program) {}
};

TEST_P(Gallery, PrintsWhatIsKnown) {
  const Ended got = run({});
  ASSERT_EQ(got.status, 0) << got.err;
  EXPECT_EQ(got.err, "");
  for (const Expected& expected : GetParam().expected()) {
    const Printed printed = quantity(got.out, expected.name, expected.which);
    const double unit = std::max(1.0, std::abs(expected.value));
    const double rounding = 8.0 * std::numeric_limits<double>::epsilon() * unit;
    // The bound is printed with two digits.
    EXPECT_LE(std::abs(printed.value - expected.value), 1.05 * printed.bound + expected.known + rounding) << expected.name;
    EXPECT_LE(printed.bound, 1e-8 * unit) << expected.name << ": the accuracy that a solve aims at";
  }
}

INSTANTIATE_TEST_SUITE_P(Pages, Gallery, testing::ValuesIn(cases),
                         [](const testing::TestParamInfo<Case>& info) { return info.param.program; });

TEST(GalleryPages, AreTestedAndShort) {
  std::set<std::string> known{failing}, found;
  for (const Case& one : cases) known.insert(one.program);
  for (const fs::directory_entry& file : fs::directory_iterator(sources)) {
    found.insert(file.path().stem().string());
    const std::string text = contents(file.path());
    EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 60) << file.path();
    EXPECT_TRUE(contains(text, "int main() {")) << file.path();
  }
  EXPECT_EQ(found, known);
}

class PendulumPage : public GalleryProgram {
 protected:
  PendulumPage() : GalleryProgram("pendulum") {}
};

TEST_F(PendulumPage, ListsAllSwingsAndRefusesTheFastest) {
  const std::string out = run({}).out;
  const auto count = [&out](const std::regex& what) {
    return std::distance(std::sregex_iterator(out.begin(), out.end(), what), std::sregex_iterator());
  };
  EXPECT_EQ(count(std::regex("extremal, [0-9]+ hits\n")), 5) << out;
  EXPECT_EQ(count(std::regex("refused: J = [^\n]* u (above its lower|below its upper) bound is -0\\.0")), 2) << out;
}

class FailingPage : public GalleryProgram {
 protected:
  FailingPage() : GalleryProgram(failing) {}
};

TEST_F(FailingPage, SaysWhyAndTheReadmeShowsIt) {
  const Ended got = run({});
  EXPECT_EQ(got.status, 1);
  EXPECT_EQ(got.out, "");
  EXPECT_TRUE(contains(got.err, "u below its upper bound is -1 at t = 0 s")) << got.err;
  EXPECT_TRUE(contains(contents(COSTATE_README), "```\n" + got.err + "```\n")) << "README.md does not show\n" << got.err;
}

TEST(GalleryReadme, ShowsPagesAsTheyAre) {
  const std::string readme = contents(COSTATE_README);
  const std::regex marker("<!-- gallery ([a-z_]+) -->\n```cpp\n");
  int shown = 0;
  for (auto at = std::sregex_iterator(readme.begin(), readme.end(), marker); at != std::sregex_iterator(); ++at, ++shown) {
    const auto begin = static_cast<std::size_t>(at->position() + at->length());
    const std::string name = (*at)[1];
    EXPECT_EQ(readme.substr(begin, readme.find("```", begin) - begin), contents(sources / (name + ".cpp"))) << name;
  }
  EXPECT_EQ(shown, 2);
}

class ReadmeRow : public GalleryProgram {
 public:
  explicit ReadmeRow(const std::string& name) : GalleryProgram(name) {}
  void TestBody() override {}
  std::string output() { return run({}).out; }
};

/// | `gallery_NAME` | problem | quantity = value[, quantity = value …] | reference |: every value is the printed one to its last digit.
TEST(GalleryReadme, TableHoldsWhatIsPrinted) {
  const std::string readme = contents(COSTATE_README);
  const std::regex row("\n\\| `gallery_([a-z_]+)` \\|[^|\n]*\\| `([^|\n]*)` \\|"),
      entry("([^,=]+) = (-?[0-9]+\\.?([0-9]*))");
  std::set<std::string> shown;
  for (auto at = std::sregex_iterator(readme.begin(), readme.end(), row); at != std::sregex_iterator(); ++at) {
    const std::string name = (*at)[1], values = (*at)[2];
    shown.insert(name);
    const std::string printed = ReadmeRow(name).output();
    std::map<std::string, int> seen;
    int entries = 0;
    for (auto one = std::sregex_iterator(values.begin(), values.end(), entry); one != std::sregex_iterator();
         ++one, ++entries) {
      const std::string what = std::regex_replace((*one)[1].str(), std::regex("^ +"), "");
      const auto digits = static_cast<int>((*one)[3].length());
      const double value = quantity(printed, what, seen[what]++).value;
      EXPECT_EQ(fmt::format("{:.{}f}", value, digits), (*one)[2].str()) << name << ": " << what;
    }
    EXPECT_GT(entries, 0) << name;
  }
  std::set<std::string> all;
  for (const Case& one : cases) all.insert(one.program);
  EXPECT_EQ(shown, all);
}

}  // namespace
}  // namespace costate::tools
