#include "tools/diastole/desk/guide_desk.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "estimator/imaging/geometry/cine_points.hpp"
#include "estimator/imaging/geometry/wall_outline.hpp"
#include "estimator/imaging/series/grey_picture.hpp"
#include "estimator/io/finding_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/signal/median.hpp"
#include "tools/diastole/desk/embedded.hpp"

namespace diastole::desk {
namespace {

namespace fs = std::filesystem;
using imaging::CineSlice;
using imaging::GuidePoint;
using imaging::GuidePoints;
using imaging::GuideSurface;
using imaging::SlicePlane;
using nlohmann::json;

constexpr size_t most_points = 200000;  // of a file; a study of 15 slices and 30 phases has 20,000

/// In micrometres, as the file holds it: what is fitted here is what `lv` fits.
Eigen::Vector3d as_written(const Eigen::Vector3d& place_mm) {
  return (1000 * place_mm.array()).round().matrix() / 1000;
}

/// An index or a point's number. Throws std::invalid_argument for anything else.
size_t whole(const json& number) {
  if (!number.is_number_unsigned())
    throw std::invalid_argument(fmt::format("{} is no whole number from 0 on", json_text(number)));
  return number.get<size_t>();
}

}  // namespace

GuideDesk::GuideDesk(const imaging::ImageFolder& folder, fs::path guide)
    : file_(std::move(guide)),
      cines_(imaging::read_cines(folder)),
      images_(std::make_shared<const std::string>(images_json())),
      phases_(cines_.phases) {
  for (const CineSlice& slice : cines_.slices)
    slices_.push_back(slice.name);
  read_points();
  if (!points_.empty()) fit();
}

GuidePoints GuideDesk::known_points() {
  std::error_code error;
  if (fs::exists(file_, error)) {
    written_ = read_whole_file(file_);
    if (!imaging::is_guide_table(written_))
      throw InputError({file_.string(), "line 1", "is no table of guide points, and would be replaced by one",
                        "Name another file. Of a GPFile `diastole lv GPFILE -o ANY.mesh --guide "
                        "NEW.guide.csv` makes a table."});
    if (::access(file_.c_str(), W_OK) != 0)
      throw InputError(
          {file_.string(), "", "may not be written", "Copy it, and give the copy with --guide."});
    const size_t rows = std::min(written_.find('\n'), written_.size());
    if (written_.find_first_not_of("\r\n", rows) == std::string::npos) return {};  // all were removed
    return imaging::guide_points_from_text(written_, file_.string());
  }
  try {
    return imaging::cine_guide_points(cines_);
  } catch (const InputError& none) {  // a person can set them
    problem_ = none.what();
    return {};
  }
}

void GuideDesk::read_points() {
  GuidePoints known = known_points();
  if (known.points.size() > most_points)
    throw InputError({file_.string(), "", fmt::format("has {} points", known.points.size()),
                      fmt::format("The desk takes {} at most.", most_points)});
  const bool are_found = written_.empty();
  findings_ = cines_.findings;
  if (!are_found) findings_.insert(findings_.end(), known.findings.begin(), known.findings.end());
  for (const std::string& name : known.slices)
    if (std::ranges::find(slices_, name) == slices_.end()) slices_.push_back(name);
  for (const int phase : known.phases)
    if (std::ranges::find(phases_, phase) == phases_.end()) phases_.push_back(phase);
  std::ranges::sort(phases_);
  for (GuidePoint& point : known.points) {
    const int phase = known.phases[point.phase];
    point.phase = static_cast<size_t>(std::ranges::lower_bound(phases_, phase) - phases_.begin());
    point.place_mm = as_written(point.place_mm);
    point.slice =
        static_cast<size_t>(std::ranges::find(slices_, known.slices[point.slice]) - slices_.begin());
    points_.emplace(next_++, point);
  }
  require_in_slices();
  if (are_found && !points_.empty()) write();
}

void GuideDesk::require_in_slices() const {
  for (size_t s = 0; s < cines_.slices.size(); ++s) {
    const SlicePlane& plane = cines_.slices[s].plane;
    std::vector<double> apart_mm;
    for (const auto& [id, point] : points_)
      if (point.slice == s) apart_mm.push_back(std::abs(plane.across_mm(point.place_mm)));
    if (apart_mm.empty()) continue;
    const double usual_mm = signal::median(std::move(apart_mm));
    constexpr double usual_thickness_mm = 5;
    const double thickness_mm = plane.thickness_mm > 0 ? plane.thickness_mm : usual_thickness_mm;
    if (usual_mm > 0.5 * thickness_mm)
      throw InputError({file_.string(), fmt::format("slice {}", cines_.slices[s].name),
                        fmt::format("its points lie {:.1f} mm from the images that are called so", usual_mm),
                        fmt::format("Give the points of this study; without a file they are found in {}.",
                                    cines_.folder.string())});
  }
}

std::span<const report::PageAsset> GuideDesk::assets() const {
  static const std::array own{report::PageAsset{"/", "text/html; charset=utf-8", embedded::guide_html},
                              report::PageAsset{"/guide.js", "text/javascript", embedded::guide_js}};
  return own;
}

std::optional<DeskAnswer> GuideDesk::get(std::string_view path) {
  if (path == "/images") return DeskAnswer{200, images_};
  if (path == "/points") return answered(points_json());
  if (path == "/state") return answered(state_json());
  if (path != "/fit") return std::nullopt;
  const std::scoped_lock lock(mutex_);
  return fit_ ? DeskAnswer{200, fit_} : refused(503, "No ventricle is fitted yet.");
}

std::optional<DeskAnswer> GuideDesk::post(std::string_view path, const std::string& body) {
  if (path == "/points") {
    change(body);
  } else if (path == "/fit") {
    fit();
  } else {
    return std::nullopt;
  }
  return answered(state_json());
}

void GuideDesk::change(const std::string& text) {
  const auto refuse = [&](const std::string& problem) {
    throw InputError({file_.string(), "", problem, "Send one change: move, set, remove or undo."});
  };
  json choice;
  try {
    choice = json::parse(text, no_deeper_than<json>());
  } catch (const std::exception& error) {
    refuse(fmt::format("the change is no JSON: {}", error.what()));
  }
  Change wanted;
  try {
    const bool is_undo = choice.at("action") == "undo";
    if (is_undo && undoing_.empty()) refuse("nothing is left to undo");
    wanted = is_undo ? undoing_.back() : parsed(choice);
  } catch (const json::exception&) {
    refuse("the change lacks something, or has it of another type: " + text.substr(0, 100));
  } catch (const std::invalid_argument& error) {
    refuse(error.what());
  }
  const bool is_undo = choice["action"] == "undo";
  const Change back = apply(wanted);
  try {
    write();
  } catch (...) {
    apply(back);
    throw;
  }
  if (is_undo)
    undoing_.pop_back();
  else
    undoing_.push_back(back);
  ++version_;
}

GuideDesk::Change GuideDesk::parsed(const json& choice) const {
  const std::string action = choice.at("action");
  const auto known = [&](size_t id) {
    const auto found = points_.find(id);
    if (found == points_.end()) throw std::invalid_argument(fmt::format("there is no point {}", id));
    return found->second;
  };
  const auto pixel_in = [](const SlicePlane& plane, const json& pixel) -> Eigen::Vector2d {
    const double column = pixel.at(0), row = pixel.at(1);
    if (!(column >= -0.5 && column <= plane.columns - 0.5 && row >= -0.5 && row <= plane.rows - 0.5))
      throw std::invalid_argument(fmt::format("({}, {}) lies outside the image", column, row));
    return {column * plane.column_spacing_mm, row * plane.row_spacing_mm};
  };
  const auto cine = [&](size_t index) -> const CineSlice& {
    if (index >= cines_.slices.size())
      throw std::invalid_argument(fmt::format("there is no image of slice {}", index));
    return cines_.slices[index];
  };
  Change change;
  if (action == "move") {
    const size_t id = whole(choice.at("point"));
    GuidePoint point = known(id);
    const SlicePlane& plane = cine(point.slice).plane;
    point.place_mm = as_written(plane.at(pixel_in(plane, choice.at("to"))) +
                                plane.across_mm(point.place_mm) * plane.normal());
    change[id] = point;
  } else if (action == "set") {
    const std::string surface_name = choice.at("surface");
    const auto surface = imaging::surface_named(surface_name);
    if (!surface) throw std::invalid_argument(fmt::format("\"{}\" is no surface", surface_name));
    const size_t slice = whole(choice.at("slice")), phase = whole(choice.at("phase"));
    const SlicePlane& plane = cine(slice).plane;
    if (phase >= cines_.phases.size() || !cines_.slices[slice].has(phase))
      throw std::invalid_argument(fmt::format("slice {} has no image of phase {}", slices_[slice], phase));
    const json& places = choice.at("at");
    if (!places.is_array() || places.empty()) throw std::invalid_argument("\"at\" is no list of places");
    if (points_.size() + places.size() > most_points)
      throw std::invalid_argument(fmt::format("there are {} points at most", most_points));
    const auto number =
        static_cast<size_t>(std::ranges::lower_bound(phases_, cines_.phases[phase]) - phases_.begin());
    for (const json& place : places)
      change[next_ + change.size()] = GuidePoint{
          number, slice, *surface, as_written(plane.at(pixel_in(plane, place))), imaging::click_sigma_mm};
  } else if (action == "remove") {
    const json& ids = choice.at("points");
    if (!ids.is_array()) throw std::invalid_argument("\"points\" is no list");
    for (const json& id : ids) {
      (void)known(whole(id));
      change[whole(id)] = std::nullopt;
    }
    if (change.empty()) throw std::invalid_argument("no point is named");
  } else {
    throw std::invalid_argument(fmt::format("\"{}\" is no action", action));
  }
  return change;
}

GuideDesk::Change GuideDesk::apply(const Change& change) {
  Change back;
  for (const auto& [id, value] : change) {
    const auto found = points_.find(id);
    back[id] = found == points_.end() ? std::nullopt : std::optional(found->second);
    if (value)
      points_.insert_or_assign(id, *value);
    else
      points_.erase(id);
    next_ = std::max(next_, id + 1);
  }
  return back;
}

GuidePoints GuideDesk::guide() const {
  std::set<size_t> shown;
  for (const auto& [id, point] : points_)
    shown.insert(point.phase);
  GuidePoints guide{.file = file_.string(), .phases = {}, .slices = slices_, .points = {}, .findings = {}};
  guide.findings = findings_;
  for (const size_t phase : shown)
    guide.phases.push_back(phases_[phase]);
  for (const auto& [id, point] : points_) {
    guide.points.push_back(point);
    guide.points.back().phase = static_cast<size_t>(std::distance(shown.begin(), shown.find(point.phase)));
  }
  return guide;
}

void GuideDesk::write() {
  std::error_code error;
  if (fs::exists(file_, error) && read_whole_file(file_) != written_)
    throw InputError(
        {file_.string(), "", "another program has changed it since the desk read it",
         "Open the desk again; or move that file away, and the next change here writes the desk's "
         "points anew."});
  std::string text = imaging::guide_file_text(guide());
  write_durable_file(file_, text);
  written_ = std::move(text);
}

void GuideDesk::fit() {
  {
    const std::scoped_lock lock(mutex_);
    if (fitting_) return;
    fitting_ = true;
    problem_.clear();
  }
  if (worker_.joinable()) worker_.join();
  worker_ = std::jthread([this, guide = guide(), version = version_] { run_fit(guide, version); });
}

void GuideDesk::run_fit(const GuidePoints& guide, size_t version) {
  std::string problem;
  std::shared_ptr<const std::string> answer;
  try {
    answer = std::make_shared<const std::string>(
        fit_json(imaging::measure_ventricle({.guide = file_}, guide), version));
  } catch (const std::exception& error) {
    problem = error.what();
  }
  const std::scoped_lock lock(mutex_);
  fitting_ = false;
  problem_ = problem;
  if (!answer) return;
  fit_ = answer;
  fitted_version_ = version;
}

std::string GuideDesk::fit_json(const imaging::VentricleSession& session, size_t version) const {
  const imaging::VentricleFit& fit = session.fit;
  json phases = json::array(), slices = json::array();
  for (size_t s = 0; s < cines_.slices.size(); ++s)
    slices.push_back({{"inner", json::array()}, {"outer", json::array()}});
  for (size_t p = 0; p < cines_.phases.size(); ++p) {
    const auto found = std::ranges::find(session.phases, cines_.phases[p], &imaging::VentriclePhase::phase);
    const bool is_fitted = found != session.phases.end();
    const auto index = static_cast<size_t>(found - session.phases.begin());
    phases.push_back(is_fitted ? json{{"cavity_mL", found->mesh.cavity_mL},
                                      {"cavity_sigma_mL", found->cavity_sigma_mL},
                                      {"wall_mL", found->mesh.wall_mL}}
                               : json());
    for (const auto& [name, side] : {std::pair("inner", -0.5), std::pair("outer", 0.5)}) {
      std::optional<imaging::WallNet> net;
      if (is_fitted) net = imaging::wall_net(fit.frame, fit.phases[index], side);
      for (size_t s = 0; s < cines_.slices.size(); ++s) {
        const SlicePlane& plane = cines_.slices[s].plane;
        const auto shift = std::ranges::find(fit.shifts, cines_.slices[s].name, &imaging::SliceShift::slice);
        const Eigen::Vector3d shift_mm =
            shift == fit.shifts.end() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : shift->shift_mm;
        json numbers = json::array();
        if (net)
          for (const imaging::Segment& piece : imaging::wall_outline(*net, plane, shift_mm))
            for (const Eigen::Vector2d& end : piece)
              for (const double number : {end.x() / plane.column_spacing_mm, end.y() / plane.row_spacing_mm})
                numbers.push_back(std::round(100 * number) / 100);  // hundredths of a pixel
        slices[s][name].push_back(std::move(numbers));
      }
    }
  }
  return json_text(json{{"version", version},
                        {"phases", std::move(phases)},
                        {"slices", std::move(slices)},
                        {"rms_mm", fit.rms_mm},
                        {"noise_factor", fit.noise_factor},
                        {"converged", fit.converged},
                        {"problems", json::parse(json_text(written(fit.findings)))}});
}

std::string GuideDesk::images_json() const {
  std::vector<imaging::Image> all;  // grey values mean the same in all slices
  for (const CineSlice& slice : cines_.slices)
    for (const Eigen::ArrayXXd& image : slice.images)
      all.emplace_back(image.cast<float>());
  const float white = imaging::white_of(all);
  json slices = json::array();
  auto image = all.begin();
  for (const CineSlice& slice : cines_.slices) {
    json images = json::array();
    for (size_t p = 0; p < slice.images.size(); ++p)
      images.push_back({{"frame", cines_.phases[p]},
                        {"trigger_ms", slice.times_ms[p]},
                        {"picture", imaging::grey_picture(*image++, white)}});
    const SlicePlane& plane = slice.plane;
    slices.push_back({{"name", slice.name},
                      {"view", imaging::orientation_in_words(plane)},
                      {"rows", plane.rows},
                      {"columns", plane.columns},
                      {"pixel_mm", {plane.column_spacing_mm, plane.row_spacing_mm}},
                      {"images", std::move(images)}});
  }
  return json_text(
      json{{"folder", cines_.folder.string()}, {"guide", file_.string()}, {"slices", std::move(slices)}});
}

std::string GuideDesk::points_json() const {
  json list = json::array();
  for (const auto& [id, point] : points_) {
    const auto phase = std::ranges::find(cines_.phases, phases_[point.phase]);
    if (point.slice >= cines_.slices.size() || phase == cines_.phases.end()) continue;
    const Eigen::Vector2d pixel = cines_.slices[point.slice].plane.pixel(point.place_mm);
    list.push_back({id, point.slice, phase - cines_.phases.begin(), imaging::name_of(point.surface),
                    pixel.x(), pixel.y(), point.sigma_mm});
  }
  return json_text(json{{"version", version_}, {"points", std::move(list)}});
}

std::string GuideDesk::state_json() const {
  const auto elsewhere = std::ranges::count_if(points_, [&](const auto& one) {
    const GuidePoint& point = one.second;
    return point.slice >= cines_.slices.size() ||
           std::ranges::find(cines_.phases, phases_[point.phase]) == cines_.phases.end();
  });
  const std::scoped_lock lock(mutex_);
  return json_text(json{{"version", version_},
                        {"points", points_.size()},
                        {"elsewhere", elsewhere},
                        {"undoable", undoing_.size()},
                        {"fitting", fitting_},
                        {"fitted_version", fitted_version_},
                        {"problem", problem_}});
}

}  // namespace diastole::desk
