#pragma once
// What the report shows of each kind of file.

#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/io/fibres_file.hpp"
#include "estimator/io/fit_file.hpp"
#include "estimator/io/flow_file.hpp"
#include "estimator/io/reconstruction_file.hpp"
#include "estimator/io/solution_file.hpp"
#include "estimator/io/tracking_file.hpp"
#include "estimator/io/ventricle_record.hpp"
#include "estimator/montecarlo/cells_file.hpp"
#include "estimator/report/page.hpp"
#include "estimator/shear/shear_fit.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole {
struct BenchTest;
struct LawComparison;
}  // namespace diastole

namespace diastole::report {

/// Pressure trace with triggers, commanded volume, pressure binned into `frames` image frames with its spread
/// over the cycles, pressure-volume loops, the schedule and what is missing.
void add_run(Page& page, const runfile::RunFile& file, size_t frames);

/// The parameters with their intervals, the specimen before and after, pressures, residuals, how the fit
/// ended.
void add_fit(Page& page, const FitRecord& fit);

/// Sections coloured by strain and stress, undeformed and under load, and profiles through the wall.
void add_solution(Page& page, const SolutionRecord& record);

/// What is wrong with the data, the field's frames, maps of residuals, errors, coverage and volume, cross-validation, tag
/// directions, slices and the worst-covered elements.
void add_reconstruction(Page& page, const ReconstructionRecord& record);

/// A cine player of every slice with its lines, what was left out and why, residuals and errors by phase. Once a page.
void add_tracking(Page& page, const TrackingRecord& record);

/// Flow and volume over the cycle, the pressure-volume loop with its stiffness, the images with the lumen's outline.
void add_flow(Page& page, const FlowRecord& flow);

/// Sections with the points that were set, volumes and wall thickness over the cycle, displaced slices.
void add_ventricle(Page& page, const VentricleRecord& heart);

/// Tensors in figures, the check of the gradients' axes, the helix through the wall, fibres of three layers, pictures of all slices.
void add_fibres(Page& page, const FibresRecord& fibres);

/// Each in its severity's dress.
void add_findings(Page& page, const std::vector<Finding>& findings);

/// A Monte Carlo table: spread and own errors of the refits by noise and number of frames, beside the paper's where they
/// are its cells.
void add_montecarlo(Page& page, const SavedTable& table);

/// C1 of a rotational shear test, Eq. 1's two sides with the line, the residuals, each load by itself.
void add_shear(Page& page, const ShearTest& test, const ShearFit& fit);

/// Laws compared (estimator/law_fit), the preferred one's parameters, and each bench test's curves.
void add_laws(Page& page, const std::vector<BenchTest>& tests, const LawComparison& comparison);

/// What the model lacks in words, with its parameters, the places of the misfit, the gap effect by effect, recordings and
/// wall before and after, all candidates' evidence and the next experiment.
void add_explanation(Page& page, const explain::Explanation& explanation);

}  // namespace diastole::report
