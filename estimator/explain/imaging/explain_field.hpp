#pragma once
// Where imaged motion and model disagree, and which field effect that is.
//
//   imaged_specimen      what an explanation asks of a specimen: gel_specimen, any_specimen
//   field_case           what the study says and what was measured
//   field_solver         gel: equilibria with field effects and their derivatives
//   field_fit            the base model, and any choice of effects, fitted to gel's motion; specimen_problem: to any other's
//   field_modes          rivals outside the library; linear_evidence: what a change of the motion would gain
//   field_hypotheses     each effect fitted, and two of them where one leaves something
//   inclusion_search     the place of an inclusion; inclusion_body, inclusion_fit: its fit on a mesh of its own
//   explain_field        the verdict
//   field_misfit         where, and what is predicted of tags not fitted; field_next_experiment: what to image next
//
// Verdicts: none - neither an effect nor any structure gains more than noise would (p above 1e-3 after correction for
// how many were tried). unexplained - structure is left after the best effect, or something outside the library (a motion,
// one wrong reading of a pressure) gains more than any effect, or a search that the name would rest on did not converge.
// ambiguous - other effects' scores are within 9 of the best one's; named - none is. The score is the gain of chi2, less 2
// for each parameter and 2 log(number of places) for a place that was searched. Another effect whose search did not converge is weighed by the
// score that it reached: within 9 it is open as any other, and what its linear model promises beyond is no gain (along the ridges where
// searches are long, most of it never comes).

#include <functional>
#include <string>

#include "estimator/explain/imaging/imaged_specimen.hpp"
#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/io/study.hpp"

namespace diastole::explain {

/// Of gel, or of any other specimen that `fit` takes. Throws InputError for studies that field_case() or any_specimen() refuses.
Explanation explain_field(const Study& study, const FieldProgress& progress = {});
/// The same of what a study says; `name` stands for it in errors.
Explanation explain_field(FieldCase field, const std::string& name, const FieldProgress& progress = {});

}  // namespace diastole::explain
