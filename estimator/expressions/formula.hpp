#pragma once
// Formulas as people write them: q_piston - G * p_pump * (1 + a * abs(p_pump) / p0)
//
//   a + b, a - b        of one dimension; kPa and Pa are converted, kPa and mL refused
//   a * b, a / b        units multiply
//   a ^ b               b a pure number; a number that is written down unless a is a pure number too
//   -a, (a)
//   a < b, <=, >, >=    true or false, for if( , , ) alone
//   1.2e-3, 30 [mL]     a pure number, a number with a unit; 0 is of any unit
//   functions           exp expm1 log log1p sin cos tanh atan Phi (the normal distribution) of pure numbers; sqrt abs sign
//                       min( , ) max( , ) if(condition, then, else); curves of the file
//
// A formula is read once into nodes of a Graph, its units checked on the way. Nothing is executed that the file holds.

#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "estimator/expressions/graph.hpp"
#include "estimator/expressions/unit.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole::expressions {

/// A name's meaning.
struct Quantity {
  NodeId node = 0;
  Unit unit = {};
};

/// A function of one argument that a file brings along.
struct Curve {
  Unit of;
  Unit unit;
  std::function<NodeId(Graph&, NodeId)> build;
};

struct Scope {
  std::map<std::string, Quantity, std::less<>> names;
  std::map<std::string, Curve, std::less<>> curves = {};
};

/// Throws InputError with line and column for what is no formula, a name that is not in `scope`, or units that do not fit.
Quantity parse_formula(const PlacedText& text, const Scope& scope, Graph& graph);

/// The same in the unit `wanted`; `what` it is for messages: "q_hose".
NodeId parse_formula_in(const PlacedText& text, const Scope& scope, Graph& graph, const Unit& wanted,
                        std::string_view what);

/// Whether a name may be used: a letter, then letters, digits and _; not that of a function.
bool is_name(std::string_view text);

/// Whether the name stands in a formula, whatever becomes of it there.
bool mentions(std::string_view formula, std::string_view name);

/// The id of a file with formulas: small letters, digits and hyphens.
std::string read_id(TableReader& root);

}  // namespace diastole::expressions
