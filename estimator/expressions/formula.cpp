#include "estimator/expressions/formula.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <vector>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole::expressions {
namespace {

constexpr int deepest = 100;  ///< nested brackets: far beyond what can be read
constexpr size_t longest_text = 10'000;

/// A part of a formula with its unit.
struct Part {
  Quantity is;
  size_t offset;              ///< where it begins in the text
  bool is_zero = false;       ///< of any unit
  bool is_condition = false;  ///< true or false
};

enum class Rule { number, root, same };

struct Function {
  std::string_view name;
  Operation operation;
  size_t arguments;
  Rule rule;
};

constexpr std::array functions{Function{"exp", Operation::exponential, 1, Rule::number},
                               Function{"expm1", Operation::exponential_minus_one, 1, Rule::number},
                               Function{"log", Operation::logarithm, 1, Rule::number},
                               Function{"log1p", Operation::logarithm_plus_one, 1, Rule::number},
                               Function{"sin", Operation::sine, 1, Rule::number},
                               Function{"cos", Operation::cosine, 1, Rule::number},
                               Function{"tanh", Operation::hyperbolic_tangent, 1, Rule::number},
                               Function{"atan", Operation::arctangent, 1, Rule::number},
                               Function{"Phi", Operation::normal, 1, Rule::number},
                               Function{"sqrt", Operation::root, 1, Rule::root},
                               Function{"abs", Operation::magnitude, 1, Rule::same},
                               Function{"sign", Operation::sign, 1, Rule::same},
                               Function{"min", Operation::minimum, 2, Rule::same},
                               Function{"max", Operation::maximum, 2, Rule::same},
                               Function{"if", Operation::select, 3, Rule::same}};

const Function* function_named(std::string_view name) {
  const auto* found = std::ranges::find(functions, name, &Function::name);
  return found == functions.end() ? nullptr : found;
}

bool is_of_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// By the precedence of operators (V. R. Pratt, "Top down operator precedence", 1973).
class Parser {
 public:
  Parser(const PlacedText& text, const Scope& scope, Graph& graph)
      : text_(text), rest_(text.text), scope_(scope), graph_(graph) {
    if (rest_.size() > longest_text) fail(0, "is too long for a formula", "Split it into several.");
  }

  Part whole() {
    Part part = guarded([&] { return binary(0); });
    skip();
    if (at_ < rest_.size())
      fail(at_, fmt::format("\"{}\" is not expected here", character_at(rest_, at_)),
           "An operator (+ - * / ^) or the formula's end comes here.");
    if (part.is_condition)
      fail(part.offset, "is true or false, not a number", "Use it in if(condition, then, else).");
    return part;
  }

  NodeId in_unit(const Part& part, const Unit& wanted, std::string_view what) {
    if (part.is_zero) return part.is.node;
    if (!part.is.unit.same_dimension(wanted))
      fail(part.offset,
           fmt::format("is in {}, but {} is in {}", name_of(part.is.unit), what, name_of(wanted)),
           "Correct the formula, or the units of its parameters.");
    return converted(part.is, wanted);
  }

 private:
  [[noreturn]] void fail(size_t offset, std::string problem, std::string remedy) const {
    throw InputError({text_.file, text_.place(offset), std::move(problem), std::move(remedy)});
  }
  template <class Make>
  auto guarded(const Make& make) -> decltype(make()) {
    try {
      return make();
    } catch (const std::length_error& error) {
      fail(0, error.what(), "Shorten them.");
    } catch (const std::domain_error& error) {
      fail(0, error.what(), "Correct the numbers in it.");
    }
  }

  void skip() {
    while (at_ < rest_.size() && std::isspace(static_cast<unsigned char>(rest_[at_])) != 0)
      ++at_;
  }
  char next() {
    skip();
    return at_ < rest_.size() ? rest_[at_] : '\0';
  }
  bool take(char sign) {
    if (next() != sign) return false;
    ++at_;
    return true;
  }
  void need(char sign, size_t opened) {
    if (!take(sign)) {
      const std::string found =
          at_ < rest_.size() ? fmt::format("\"{}\"", character_at(rest_, at_)) : "the end";
      fail(at_, fmt::format("{} stands where \"{}\" is expected", found, sign),
           fmt::format("It closes what begins at {}.", text_.place(opened)));
    }
  }

  NodeId converted(const Quantity& quantity, const Unit& to) {
    const double factor = factor_between(quantity.unit, to);
    return factor == 1.0 ? quantity.node : graph_.scaled(factor, quantity.node);
  }
  NodeId pure(const Part& part, std::string_view of) {
    require_value(part);
    if (!part.is_zero && !part.is.unit.is_number())
      fail(part.offset, fmt::format("{} needs a pure number, not {}", of, name_of(part.is.unit)),
           "Divide it by a quantity of the same unit.");
    return converted(part.is, Unit{});
  }
  void require_value(const Part& part) const {
    if (part.is_condition)
      fail(part.offset, "is true or false, not a number", "Use it in if(condition, then, else).");
  }
  /// Both in one unit, that of the first unless it is zero.
  std::pair<NodeId, NodeId> alike(const Part& a, const Part& b, size_t at, std::string_view verb) {
    require_value(a);
    require_value(b);
    if (a.is_zero || b.is_zero) return {a.is.node, b.is.node};
    if (!a.is.unit.same_dimension(b.is.unit))
      fail(at, fmt::format("{} {} and {}", verb, name_of(a.is.unit), name_of(b.is.unit)),
           "Both sides must measure the same: correct the formula, or the units of its parameters.");
    return {a.is.node, converted(b.is, a.is.unit)};
  }

  struct Operator {
    std::string_view sign;
    int strength;  ///< with which it holds what stands at its left
    Operation operation;
    bool swapped = false;
  };
  std::optional<Operator> operator_here() {
    static constexpr std::array known{
        Operator{"<=", 1, Operation::at_most}, Operator{">=", 1, Operation::at_most, true},
        Operator{"<", 1, Operation::less},     Operator{">", 1, Operation::less, true},
        Operator{"+", 2, Operation::add},      Operator{"-", 2, Operation::subtract},
        Operator{"*", 3, Operation::multiply}, Operator{"/", 3, Operation::divide},
        Operator{"^", 5, Operation::power}};
    skip();
    for (const Operator& one : known)
      if (rest_.substr(at_).starts_with(one.sign)) return one;
    return {};
  }
  static constexpr int of_sign = 4;  ///< -a^2 is -(a^2), -a * b is (-a) * b

  Part binary(int least) {
    if (++depth_ > deepest) fail(at_, "is nested too deeply", "Split the formula into several.");
    Part left = operand();
    for (auto found = operator_here(); found && found->strength > least; found = operator_here()) {
      const size_t at = at_;
      at_ += found->sign.size();
      const bool from_right = found->operation == Operation::power;
      const Part right = binary(from_right ? of_sign : found->strength);
      left = joined(*found, left, right, at);
    }
    --depth_;
    return left;
  }

  Part joined(const Operator& by, const Part& a, const Part& b, size_t at) {
    Part whole{.is = {}, .offset = a.offset};
    switch (by.operation) {
      case Operation::add:
      case Operation::subtract: {
        const auto [left, right] =
            alike(a, b, at, by.operation == Operation::add ? "adds" : "takes the difference of");
        whole.is = {graph_.make(by.operation, left, right), a.is_zero ? b.is.unit : a.is.unit};
        whole.is_zero = a.is_zero && b.is_zero;
        return whole;
      }
      case Operation::less:
      case Operation::at_most: {
        const auto [left, right] = alike(a, b, at, "compares");
        whole.is = {
            by.swapped ? graph_.make(by.operation, right, left) : graph_.make(by.operation, left, right),
            Unit{}};
        whole.is_condition = true;
        return whole;
      }
      case Operation::power:
        return power(a, b);
      default:
        require_value(a);
        require_value(b);
        if (by.operation == Operation::divide && (b.is_zero || graph_.is_number(b.is.node, 0.0)))
          fail(b.offset, "divides by zero", "Correct it.");
        whole.is = {graph_.make(by.operation, a.is.node, b.is.node),
                    by.operation == Operation::multiply ? a.is.unit * b.is.unit : a.is.unit / b.is.unit};
        whole.is_zero = a.is_zero || b.is_zero;
        return whole;
    }
  }

  Part power(const Part& base, const Part& exponent) {
    require_value(base);
    const NodeId by = pure(exponent, "a power");
    Part whole{.is = {}, .offset = base.offset};
    constexpr double most_products = 8.0;
    if (graph_[by].operation != Operation::number) {
      whole.is = {
          graph_.make(Operation::power, pure(base, "the base of a power that is no written number"), by),
          Unit{}};
      return whole;
    }
    const double power = graph_[by].value;
    const auto unit = to_power(base.is.unit, power);
    if (!unit)
      fail(exponent.offset, fmt::format("{} to the power {} has no unit", name_of(base.is.unit), power),
           "Choose a power that leaves whole or simple roots of units.");
    if (power == std::round(power) && std::abs(power) <= most_products) {
      NodeId product = graph_.number(1.0);
      for (double k = 0.0; k < std::abs(power); k += 1.0)
        product = graph_.product(product, base.is.node);
      whole.is = {power < 0.0 ? graph_.make(Operation::divide, graph_.number(1.0), product) : product, *unit};
    } else if (power == 0.5) {
      whole.is = {graph_.make(Operation::root, base.is.node), *unit};
    } else {
      whole.is = {graph_.make(Operation::power, base.is.node, graph_.number(power)), *unit};
    }
    return whole;
  }

  Part operand() {
    const char sign = next();
    const size_t at = at_;
    if (sign == '-' || sign == '+') {
      ++at_;
      Part part = binary(of_sign);
      require_value(part);
      part.offset = at;
      if (sign == '-') part.is.node = graph_.make(Operation::negate, part.is.node);
      return part;
    }
    if (sign == '(') {
      ++at_;
      Part part = binary(0);
      need(')', at);
      part.offset = at;
      return part;
    }
    if (std::isdigit(static_cast<unsigned char>(sign)) != 0 || sign == '.') return written_number();
    if (std::isalpha(static_cast<unsigned char>(sign)) != 0 || sign == '_') return name();
    if (sign == '\0') fail(at, "ends where a quantity is expected", "Complete the formula.");
    fail(at, fmt::format("\"{}\" stands where a quantity is expected", character_at(rest_, at)),
         "A number, a name, a function or a bracket comes here.");
  }

  Part written_number() {
    const size_t at = at_;
    double value = 0.0;
    const char* from = rest_.data() + at_;
    const auto [end, error] = std::from_chars(from, rest_.data() + rest_.size(), value);
    if (error != std::errc{}) fail(at, "is not a number", "Write it as 12, 0.5 or 1.2e-3.");
    at_ += static_cast<size_t>(end - from);
    Part part{.is = {graph_.number(value), Unit{}}, .offset = at, .is_zero = value == 0.0};
    if (next() != '[') return part;
    const size_t open = at_;
    const size_t close = rest_.find(']', open);
    const auto unit =
        close == std::string_view::npos ? std::nullopt : parse_unit(rest_.substr(open + 1, close - open - 1));
    if (!unit) fail(open, "holds no unit that is known", "Write for example 30 [mL] or 2 [kPa s/mL].");
    at_ = close + 1;
    part.is.unit = *unit;
    part.is_zero = false;
    return part;
  }

  Part name() {
    const size_t at = at_;
    while (at_ < rest_.size() && is_of_name(rest_[at_]))
      ++at_;
    const std::string name(rest_.substr(at, at_ - at));
    if (next() == '(') return call(name, at);
    if (name == "pi") return {.is = {graph_.number(std::numbers::pi), Unit{}}, .offset = at};
    const auto known = scope_.names.find(name);
    if (known == scope_.names.end()) {
      std::vector<std::string> names;
      for (const auto& [other, meaning] : scope_.names)
        names.push_back(other);
      fail(at, fmt::format("there is no quantity \"{}\" here", name),
           did_you_mean(name, names) + fmt::format("Known: {}.", listed(names)));
    }
    return {.is = known->second, .offset = at};
  }

  static std::string listed(const std::vector<std::string>& words) {
    std::string list;
    for (const std::string& name : words)
      list += (list.empty() ? "" : ", ") + name;
    return list;
  }

  Part call(const std::string& name, size_t at) {
    const size_t open = at_++;
    std::vector<Part> given;
    do
      given.push_back(binary(0));
    while (take(','));
    need(')', open);
    Part whole{.is = {}, .offset = at};
    if (const auto curve = scope_.curves.find(name); curve != scope_.curves.end()) {
      require_count(name, at, given.size(), 1);
      const NodeId argument = in_unit(given[0], curve->second.of, "the curve's argument");
      whole.is = {curve->second.build(graph_, argument), curve->second.unit};
      return whole;
    }
    const Function* function = function_named(name);
    if (function == nullptr) {
      std::vector<std::string> names;
      for (const Function& other : functions)
        names.emplace_back(other.name);
      for (const auto& [other, curve] : scope_.curves)
        names.push_back(other);
      fail(at, fmt::format("there is no function \"{}\"", name),
           did_you_mean(name, names) + fmt::format("Known: {}.", listed(names)));
    }
    require_count(name, at, given.size(), function->arguments);
    if (function->rule == Rule::number) {
      whole.is = {graph_.make(function->operation, pure(given[0], name)), Unit{}};
    } else if (function->rule == Rule::root) {
      require_value(given[0]);
      const auto unit = to_power(given[0].is.unit, 0.5);
      if (!unit) fail(given[0].offset, "has a unit that has no root", "Correct the formula.");
      whole.is = {graph_.make(function->operation, given[0].is.node), *unit};
    } else if (function->operation == Operation::select) {
      if (!given[0].is_condition)
        fail(given[0].offset, "is no condition", "Compare two quantities: if(V > 10 [mL], then, else).");
      const auto [then, otherwise] = alike(given[1], given[2], given[2].offset, "chooses between");
      whole.is = {graph_.make(Operation::select, given[0].is.node, then, otherwise),
                  given[1].is_zero ? given[2].is.unit : given[1].is.unit};
      whole.is_zero = given[1].is_zero && given[2].is_zero;
    } else if (function->arguments == 2) {
      const auto [a, b] = alike(given[0], given[1], given[1].offset, "compares");
      whole.is = {graph_.make(function->operation, a, b),
                  given[0].is_zero ? given[1].is.unit : given[0].is.unit};
      whole.is_zero = given[0].is_zero && given[1].is_zero;
    } else {
      require_value(given[0]);
      whole.is = {graph_.make(function->operation, given[0].is.node),
                  function->operation == Operation::sign ? Unit{} : given[0].is.unit};
      whole.is_zero = given[0].is_zero;
    }
    return whole;
  }

  void require_count(const std::string& name, size_t at, size_t given, size_t wanted) const {
    if (given != wanted)
      fail(at, fmt::format("{} has {} arguments here", name, given), fmt::format("It takes {}.", wanted));
  }

  const PlacedText& text_;
  std::string_view rest_;
  const Scope& scope_;
  Graph& graph_;
  size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace

Quantity parse_formula(const PlacedText& text, const Scope& scope, Graph& graph) {
  return Parser(text, scope, graph).whole().is;
}

NodeId parse_formula_in(const PlacedText& text, const Scope& scope, Graph& graph, const Unit& wanted,
                        std::string_view what) {
  Parser parser(text, scope, graph);
  return parser.in_unit(parser.whole(), wanted, what);
}

bool is_name(std::string_view text) {
  if (text.empty() || text == "pi" || function_named(text) != nullptr) return false;
  if (std::isalpha(static_cast<unsigned char>(text.front())) == 0) return false;
  return std::ranges::all_of(text, is_of_name);
}

bool mentions(std::string_view formula, std::string_view name) {
  for (size_t from = 0; from < formula.size();) {
    size_t end = from;
    while (end < formula.size() && is_of_name(formula[end]))
      ++end;
    if (formula.substr(from, end - from) == name) return true;
    from = std::max(end, from + 1);
  }
  return false;
}

std::string read_id(TableReader& root) {
  std::string id = root.text("id");
  const bool is_id = !id.empty() && std::ranges::all_of(id, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-';
  });
  if (!is_id)
    root.fail("id", fmt::format("\"{}\" is no id", id),
              "Write small letters, digits and hyphens, as \"my-seal\".");
  return id;
}

}  // namespace diastole::expressions
