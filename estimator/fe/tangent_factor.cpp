#include "estimator/fe/tangent_factor.hpp"

namespace diastole {

FactorResult TangentFactor::factorise_symmetric(std::span<double> values, bool cavity_held) {
  std::unique_ptr<SparseFactor>& factor = cavity_held ? volume_given_ : pressure_given_;
  if (!factor) {
    const size_t entries = equations_->entries(cavity_held);
    factor =
        std::make_unique<SparseFactor>(equations_->unknowns(cavity_held), equations_->rows().first(entries),
                                       equations_->columns().first(entries));
  }
  current_ = factor.get();
  return current_->factorise(values);
}

FactorResult TangentFactor::factorise_general(std::span<const double> values, std::span<const double> skew) {
  if (!general_) prepare_general();
  general_values_.assign(values.begin(), values.end());
  for (size_t n = 0; n < values.size(); ++n) {
    if (equations_->rows()[n] != equations_->columns()[n]) general_values_.push_back(values[n]);
  }
  for (const double value : skew) {
    general_values_.push_back(value);
    general_values_.push_back(-value);
  }
  current_ = general_.get();
  return current_->factorise(general_values_);
}

void TangentFactor::prepare_general() {
  const size_t entries = equations_->entries();
  general_rows_.assign(equations_->rows().begin(),
                       equations_->rows().begin() + static_cast<std::ptrdiff_t>(entries));
  general_columns_.assign(equations_->columns().begin(),
                          equations_->columns().begin() + static_cast<std::ptrdiff_t>(entries));
  for (size_t n = 0; n < entries; ++n) {
    if (equations_->rows()[n] == equations_->columns()[n]) continue;
    general_rows_.push_back(equations_->columns()[n]);
    general_columns_.push_back(equations_->rows()[n]);
  }
  for (size_t n = 0; n < skew_->rows().size(); ++n) {
    for (const bool mirrored : {false, true}) {
      general_rows_.push_back(1 + (mirrored ? skew_->columns() : skew_->rows())[n]);
      general_columns_.push_back(1 + (mirrored ? skew_->rows() : skew_->columns())[n]);
    }
  }
  general_ = std::make_unique<SparseFactor>(equations_->unknowns(), general_rows_, general_columns_,
                                            MatrixKind::general);
}

}  // namespace diastole
