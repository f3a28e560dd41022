// Formulas: what they compute, which units they refuse and where, and their derivatives.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "estimator/expressions/curve.hpp"
#include "estimator/expressions/formula.hpp"
#include "estimator/expressions/program.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::expressions {
namespace {

/// p in kPa, V in mL, t in s, x and y pure numbers; inputs in this order.
class Formulas : public testing::Test {
 protected:
  Formulas() {
    size_t index = 0;
    for (const auto& [name, unit] : {std::pair{"p", "kPa"}, std::pair{"V", "mL"}, std::pair{"t", "s"},
                                     std::pair{"x", "1"}, std::pair{"y", "1"}, std::pair{"r", "Pa/s"}})
      scope_.names[name] = {graph_.input(index++), *parse_unit(unit)};
  }
  double value(const std::string& text) {
    const Quantity quantity = parse_formula({.text = text}, scope_, graph_);
    return Program(graph_, std::vector{quantity.node})(inputs_.data());
  }
  std::string unit(const std::string& text) {
    return name_of(parse_formula({.text = text}, scope_, graph_).unit);
  }
  InputFault fault(const PlacedText& text) {
    try {
      parse_formula(text, scope_, graph_);
    } catch (const InputError& error) {
      return error.fault();
    }
    ADD_FAILURE() << text.text << " is read";
    return {};
  }
  InputFault fault(const std::string& text) {
    return fault(PlacedText{.text = text, .file = "f", .key = "k"});
  }

  Graph graph_;
  Scope scope_;
  std::vector<double> inputs_{3.0, 20.0, 1.5, 0.4, -2.0, 8.0};
};

TEST_F(Formulas, BindAsPeopleWriteThem) {
  EXPECT_DOUBLE_EQ(value("1 + 2 * 3 ^ 2"), 19.0);
  EXPECT_DOUBLE_EQ(value("-x^2"), -0.16);
  EXPECT_DOUBLE_EQ(value("2 ^ 3 ^ 2"), 512.0);
  EXPECT_DOUBLE_EQ(value("8 / 4 / 2 - 3 - 4"), -6.0);
  EXPECT_DOUBLE_EQ(value("2 ^ -1 * (1 + x)"), 0.7);
  EXPECT_DOUBLE_EQ(value("if(x > 0.3, 1, 2) + if(y >= 0, 10, 20)"), 21.0);
  EXPECT_DOUBLE_EQ(value("min(x, y) + max(x, y)"), -1.6);
  EXPECT_DOUBLE_EQ(value("Phi(0) + sign(y) + abs(y)"), 1.5);
  EXPECT_DOUBLE_EQ(value("expm1(x) - (exp(x) - 1)"), std::expm1(0.4) - (std::exp(0.4) - 1.0));
  EXPECT_DOUBLE_EQ(value("sin(pi / 2)"), 1.0);
}

TEST_F(Formulas, ConvertUnitsOfOneDimension) {
  EXPECT_DOUBLE_EQ(value("p + r * t"), 3.0 + 0.012);
  EXPECT_DOUBLE_EQ(value("p - 500 [Pa]"), 2.5);
  EXPECT_DOUBLE_EQ(value("exp(t / 1500 [ms])"), std::exp(1.0));
  EXPECT_EQ(value("p + 0"), 3.0);
}

TEST_F(Formulas, CarryUnits) {
  EXPECT_EQ(unit("V / (t * p)"), "mL/(kPa s)");
  EXPECT_EQ(unit("sqrt(V * V)"), "mL");
  EXPECT_EQ(unit("V^2 / V^2"), "a pure number");
  EXPECT_EQ(unit("if(x < 1, 0, p)"), "kPa");
}

TEST_F(Formulas, RefuseSumsOfDifferentThingsWithPlaceAndBothUnits) {
  const InputFault found = fault(
      PlacedText{.text = "p * x\n  + V", .file = "a.toml", .key = "equations.p", .line = 7, .column = 6});
  EXPECT_EQ(found.file, "a.toml");
  EXPECT_EQ(found.place, "line 8, column 3, key equations.p");
  EXPECT_NE(found.problem.find("kPa"), std::string::npos) << found.problem;
  EXPECT_NE(found.problem.find("mL"), std::string::npos) << found.problem;
}

TEST_F(Formulas, RefuseWhatIsNone) {
  for (const char* text : {"",       "p +",      "(p",      "p p",         "p + V",
                           "p < V",  "exp(p)",   "p ^ x",   "x ^ p",       "if(x, 1, 2)",
                           "x > 1",  "sin()",    "max(p)",  "3 [furlong]", "q",
                           "run(x)", "1 / 0",    "log(-1)", "p # 2",       "x ^ 0.5 + V ^ 0.3333",
                           "((p)",   "min(p, V)"})
    EXPECT_FALSE(fault(text).problem.empty()) << text;
  EXPECT_NE(fault("p + tt").remedy.find("Did you mean \"t\""), std::string::npos) << fault("p + tt").remedy;
  EXPECT_FALSE(fault(std::string(5000, '(')).problem.empty());
  EXPECT_FALSE(fault(std::string(20000, '1')).problem.empty());
}

TEST_F(Formulas, RefuseADivisionByWhatIsZeroWithItsPlace) {
  for (const char* text : {"p / (2 - 2)", "p / (0 * V)", "p / 0 [s]", "p / sin(0)"}) {
    EXPECT_EQ(fault(text).place, "line 1, column 5, key k") << text;
    EXPECT_EQ(fault(text).problem, "divides by zero") << text;
  }
}

TEST_F(Formulas, ShowWholeCharactersAndCountThem) {
  EXPECT_EQ(fault("x + y½").problem, "\"½\" is not expected here");
  EXPECT_EQ(fault("x + €").problem, "\"€\" stands where a quantity is expected");
  EXPECT_EQ(fault("(x €").problem, "\"€\" stands where \")\" is expected");
  EXPECT_EQ(fault("x ½ € V").place, "line 1, column 3, key k");
}

TEST_F(Formulas, NamePureNumbersByTheirUnits) {
  EXPECT_EQ(fault("p + 5 [%]").problem, "adds kPa and %");
  EXPECT_EQ(unit("3 [ppm]"), "ppm");
  EXPECT_EQ(unit("90 [deg]"), "deg");
  EXPECT_EQ(unit("p / 3 [Pa]"), "a pure number times 1000");
}

TEST_F(Formulas, BeginNamesWithALetter) {
  EXPECT_TRUE(is_name("a_1"));
  for (const char* text : {"", "_a", "1a", "a-b", "a½", "pi", "sin"})
    EXPECT_FALSE(is_name(text)) << text;
}

TEST_F(Formulas, MentionWholeNames) {
  EXPECT_TRUE(mentions("2 * a + sin(b_1)", "b_1"));
  for (const char* name : {"b", "_1", "si", "2a", "c"})
    EXPECT_FALSE(mentions("2 * a + sin(b_1)", name)) << name;
}

TEST_F(Formulas, HaveTheDerivativesOfDualNumbers) {
  using Dual = ceres::Jet<double, 6>;
  using Second = ceres::Jet<Dual, 6>;
  for (const char* text :
       {"x * y - x / y", "exp(x * y) * sin(x)", "sqrt(x) + log(x) * cos(y)", "x ^ 2.5 + (x ^ 3) / (y ^ 2)",
        "tanh(x * y) + atan(x)", "expm1(x * x) + log1p(x) * abs(y)", "Phi(x - y) * max(x, y) + min(x * x, y)",
        "if(x > y, x * x * x, y)", "x ^ (x * 2)"}) {
    const NodeId node = parse_formula({.text = text}, scope_, graph_).node;
    std::vector<Second> inputs(6);
    for (size_t i = 0; i < 6; ++i) {
      inputs[i] = constant<Second>(inputs_[i]);
      inputs[i].a = Dual(inputs_[i], static_cast<int>(i));
      inputs[i].v[static_cast<Eigen::Index>(i)] = Dual(1.0);
    }
    Second by_duals;
    Program(graph_, std::vector{node}).run(inputs.data(), &by_duals);
    for (const size_t i : {3UL, 4UL}) {
      const NodeId slope = graph_.derivative(node, i);
      EXPECT_NEAR(Program(graph_, std::vector{slope})(inputs_.data()),
                  by_duals.v[static_cast<Eigen::Index>(i)].a, 1e-13)
          << text;
      for (const size_t j : {3UL, 4UL}) {
        const double bend = Program(graph_, std::vector{graph_.derivative(slope, j)})(inputs_.data());
        EXPECT_NEAR(bend, by_duals.v[static_cast<Eigen::Index>(i)].v[static_cast<Eigen::Index>(j)],
                    1e-12 * (1.0 + std::abs(bend)))
            << text;
      }
    }
  }
}

TEST_F(Formulas, TakeCurvesThatPassThroughTheirPoints) {
  const std::vector<double> at{-1.0, 0.0, 0.5, 2.0}, values{1.0, 0.0, 0.3, -1.0};
  scope_.curves["f"] = tabulated_curve(at, values, *parse_unit("1"), *parse_unit("kPa"));
  const NodeId node = parse_formula({.text = "f(x)"}, scope_, graph_).node;
  const Program curve(graph_, std::vector{node, graph_.derivative(node, 3)});
  const auto shown = [&](double x) {
    inputs_[3] = x;
    std::array<double, 2> value_and_slope{};
    curve.run(inputs_.data(), value_and_slope.data());
    return value_and_slope;
  };
  for (size_t k = 0; k < at.size(); ++k) {
    EXPECT_NEAR(shown(at[k])[0], values[k], 1e-14);
    EXPECT_NEAR(shown(at[k] - 1e-9)[1], shown(at[k] + 1e-9)[1], 1e-7) << at[k];
  }
  EXPECT_NEAR(shown(4.0)[1], shown(9.0)[1], 1e-14);  // straight beyond
  EXPECT_EQ(unit("f(x)"), "kPa");
}

}  // namespace
}  // namespace diastole::expressions
