#include "estimator/report/report.hpp"

#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "estimator/explain/verdict/explanation_json.hpp"
#include "estimator/io/fibres_file.hpp"
#include "estimator/io/fit_file.hpp"
#include "estimator/io/flow_file.hpp"
#include "estimator/io/reconstruction_file.hpp"
#include "estimator/io/solution_file.hpp"
#include "estimator/io/tracking_file.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/shear/shear_fit.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole::report {
namespace {

enum class Kind {
  explanation,
  tracking,
  flow,
  fibres,
  fit,
  table,
  reconstruction,
  solution,
  shear_test,
  run
};

/// A run of an hour is not read for it.
bool is_hdf5(const std::filesystem::path& file) {
  constexpr std::string_view signature("\x89HDF\r\n\x1a\n", 8);
  std::string head(signature.size(), '\0');
  std::ifstream(file, std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size()));
  return head == signature;
}

bool is_json_object(const std::string& content) {
  const size_t first = content.find_first_not_of(" \t\r\n");
  return first != std::string::npos && content[first] == '{';
}

constexpr const char* flow_title = "Flow and volume over the cycle";
constexpr const char* fibres_title = "Fibres from diffusion";

std::string title_of(size_t estimates, size_t runs) {
  if (estimates == 0) return runs == 1 ? "A pump session" : "Pump sessions";
  return runs == 0 ? "Material stiffness" : "From a pump session to a material stiffness";
}

std::string explanation_title(const std::vector<explain::Explanation>& explanations) {
  if (explanations.size() > 1) return "Where models and measurements disagree";
  std::string name = std::filesystem::path(explanations[0].study).filename().string();
  name = name.substr(0, name.find(".study.toml"));
  return "Where model and measurement disagree" + (name.empty() ? "" : ": " + name);
}

/// The record of the images that a fit began with: where it was, or beside the fit, if that has moved. None if it is gone or none any more.
std::optional<TrackingRecord> images_of(const FitRecord& fit, const std::filesystem::path& file) {
  if (!fit.images) return {};
  const std::filesystem::path stated = *fit.images;
  for (const std::filesystem::path& place : {stated, file.parent_path() / stated.filename()}) {
    try {
      if (std::filesystem::is_regular_file(place))
        return tracking_record_from_json(read_whole_file(place), place.string());
    } catch (const InputError&) {
      continue;  // the fit stands without them
    }
  }
  return {};
}

}  // namespace

std::string make_report(std::span<const std::filesystem::path> files, size_t frames) {
  std::map<Kind, std::vector<std::function<void(Page&)>>> parts;  // in the order of the page
  std::vector<explain::Explanation> explanations;
  std::optional<TrackingRecord> of_fit;
  const auto add = [&](Kind kind, auto read, auto draw) {
    parts[kind].emplace_back([read = std::move(read), draw](Page& page) { draw(page, read); });
  };
  for (const std::filesystem::path& file : files) {
    if (is_hdf5(file)) {
      add(Kind::run, runfile::open_run(file),
          [&](Page& page, const runfile::RunFile& run) { add_run(page, run, frames); });
      continue;
    }
    const std::string content = read_whole_file(file);
    const std::string name = file.string();
    if (is_shear_test(content)) {
      add(Kind::shear_test, shear_test_from_text(content, name),
          [](Page& page, const ShearTest& test) { add_shear(page, test, fit_shear(test)); });
    } else if (is_cells_file(content)) {
      add(Kind::table, saved_table(content, name), add_montecarlo);
    } else if (!is_json_object(content)) {
      throw InputError(
          {name, "",
           std::string(content.empty() ? "is empty, " : "is ") +
               "neither a run file nor a record of a fit, an explanation, a Monte Carlo table, a "
               "reconstruction, a solution, tracked images, flow or fibres, nor a shear test",
           "Give files that `diastole run`, `simulate`, `montecarlo --cells`, `fit -o`, `explain -o`, "
           "`solve` or `reconstruct` with -o NAME.json, or `track`, `flow` or `fibres` with --record "
           "wrote, or the CSV that `diastole shear` reads."});
    } else if (explain::is_explanation(content)) {
      explanations.push_back(explain::explanation_from_json(content, name));
      add(Kind::explanation, explanations.back(), add_explanation);
    } else if (is_solution(content)) {
      add(Kind::solution, solution_record_from_json(content, name), add_solution);
    } else if (is_tracking(content)) {
      if (parts.contains(Kind::tracking))
        throw InputError({name, "", "is a second record of tracked images", "Give one a page."});
      add(Kind::tracking, tracking_record_from_json(content, name), add_tracking);
    } else if (is_flow(content)) {
      add(Kind::flow, flow_record_from_json(content, name), add_flow);
    } else if (is_fibres(content)) {
      add(Kind::fibres, fibres_record_from_json(content, name), add_fibres);
    } else if (is_reconstruction(content)) {
      add(Kind::reconstruction, reconstruction_record_from_json(content, name), add_reconstruction);
    } else {
      FitRecord fit = fit_record_from_json(content, name);
      if (!of_fit) of_fit = images_of(fit, file);
      add(Kind::fit, std::move(fit), add_fit);
    }
  }
  // A page shows one set of images: the one that was given for it, or the first fit's.
  if (!parts.contains(Kind::tracking) && of_fit) add(Kind::tracking, std::move(*of_fit), add_tracking);
  const auto count = [&](Kind kind) { return parts.contains(kind) ? parts.at(kind).size() : 0; };
  const size_t estimates = count(Kind::fit) + count(Kind::shear_test) + count(Kind::table);
  const bool only_images =
      count(Kind::reconstruction) + count(Kind::tracking) > 0 && count(Kind::solution) == 0;
  Page page(!explanations.empty()                   ? explanation_title(explanations)
            : estimates > 0 || count(Kind::run) > 0 ? title_of(estimates, count(Kind::run))
            : only_images                           ? "Displacement from tagged images"
            : count(Kind::flow) > 0                 ? flow_title
            : count(Kind::fibres) > 0               ? fibres_title
                                                    : "Strain and stress under load");
  for (const auto& [kind, drawings] : parts) {
    for (const auto& draw : drawings)
      draw(page);
  }
  return page.html();
}

std::string make_report(const TrackingRecord& record) {
  Page page("Tags followed through the cycle");
  add_tracking(page, record);
  return page.html();
}

std::string make_report(const FlowRecord& record) {
  Page page(flow_title);
  add_flow(page, record);
  return page.html();
}

std::string make_report(const VentricleRecord& record) {
  Page page("A ventricle's walls and volumes");
  add_ventricle(page, record);
  return page.html();
}

std::string make_report(const FibresRecord& record) {
  Page page(fibres_title);
  add_fibres(page, record);
  return page.html();
}

std::string make_report(const explain::Explanation& explanation) {
  Page page(explanation_title({explanation}));
  add_explanation(page, explanation);
  return page.html();
}

}  // namespace diastole::report
