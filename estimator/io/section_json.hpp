#pragma once
// Drawn sections and fields as JSON, for the files that `diastole report` reads. Numbers are kept to six significant
// digits (six_digits with round_numbers), which is more than a drawing shows.

#include <cmath>

#include "estimator/io/member_json.hpp"
#include "estimator/io/solution_file.hpp"

namespace diastole {

template <IsRecord<NamedField> Field>
auto key_and_value(Field& field) {
  return std::tie(field.name, field.values);
}

template <class Visit, IsRecord<SolutionSection> Record>
void each_member(Visit&& visit, Record& section) {
  DIASTOLE_VISIT(visit, section, title, horizontal, vertical, cells_before, cells_after, outline_before,
                 outline_after, elements_before, elements_after)
  visit("fields", by_name(section.fields));
}

inline double six_digits(double value) {
  if (std::abs(value) < 1e-9) return 0.0;
  const double power = std::pow(10.0, 5 - std::floor(std::log10(std::abs(value))));
  return std::round(value * power) / power;
}

/// Throws std::invalid_argument unless each field has `count` values.
inline void require_lengths(const std::vector<NamedField>& fields, size_t count) {
  for (const NamedField& field : fields) {
    if (field.values.size() != count) throw std::invalid_argument(field.name + " has another length");
  }
}

inline void require_sound(const std::vector<SolutionSection>& sections) {
  for (const SolutionSection& section : sections) {
    if (section.cells_before.size() != section.cells_after.size())
      throw std::invalid_argument("cells_before and cells_after differ in number");
    require_lengths(section.fields, section.cells_before.size());
  }
}

}  // namespace diastole
