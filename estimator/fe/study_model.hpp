#pragma once
// The forward model that a study describes: its mesh, law, start values and supports.

#include "estimator/fe/elastic_model.hpp"
#include "estimator/io/study.hpp"

namespace diastole {

/// Parameters take their `start`. Throws InputError if the law is unknown, if the study lacks one of its
/// parameters or has one that it does not know, if a start lies outside what the law allows, or if it names
/// an effect (the model has none).
ElasticModel make_model(const Study& study, SolveOptions options = {});

}  // namespace diastole
