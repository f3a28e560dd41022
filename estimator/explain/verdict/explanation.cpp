#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::named:
      return "named";
    case Verdict::ambiguous:
      return "ambiguous";
    case Verdict::unexplained:
      return "unexplained";
    case Verdict::none:
      return "none";
  }
  return "none";
}

}  // namespace diastole::explain
