#pragma once
// The report: one self-contained page about any number of run files, fit results, explanations, solutions and shear
// tests.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/io/fibres_file.hpp"
#include "estimator/io/flow_file.hpp"
#include "estimator/io/tracking_file.hpp"
#include "estimator/io/ventricle_record.hpp"

namespace diastole::report {

/// The page's HTML. Files are recognised by their content; explanations come first, then tracked images, flows, fibres, fits,
/// shear tests, then runs, each in the given order. `frames`: image frames of a cycle. Throws InputError for a file that is missing, unreadable or of no kind that the report knows.
std::string make_report(std::span<const std::filesystem::path> files, size_t frames = 16);

/// The same page of tracked images at hand.
std::string make_report(const TrackingRecord& record);

/// The same page of a flow at hand.
std::string make_report(const FlowRecord& record);

/// The page of a fitted ventricle.
std::string make_report(const VentricleRecord& record);

/// The same page of measured fibres at hand.
std::string make_report(const FibresRecord& record);

/// The same page of an explanation at hand.
std::string make_report(const explain::Explanation& explanation);

}  // namespace diastole::report
