#include "estimator/imaging/tracking/manual_edits.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "estimator/imaging/series/image_folder.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole::imaging {
namespace {

using Json = nlohmann::json;

constexpr std::array action_names = {"line", "mask", "contour", "height"};

/// One line of the file and what is wrong with it.
class EditLine {
 public:
  EditLine(const std::filesystem::path& file, size_t number) : file_(file), number_(number) {}

  [[noreturn]] void refuse(const std::string& problem, const std::string& remedy) const {
    throw InputError({file_.string(), fmt::format("line {}", number_), problem, remedy});
  }

  void parse(const std::string& text) {
    try {
      json_ = Json::parse(text, no_deeper_than<Json>());
    } catch (const JsonTooDeep& error) {
      refuse(fmt::format("is {}", error.what()), "A line is one choice, with lists of points in it.");
    } catch (const Json::exception&) {
      refuse(fmt::format("is no JSON: {}", text.size() > 60 ? text.substr(0, 60) + "..." : text),
             "A line is one choice, {\"slice\": ..., \"phase\": ..., \"action\": ..., \"points\": [[column, "
             "row], "
             "...]}; mend or delete it.");
    }
    if (!json_.is_object()) refuse("is no JSON object", "A line is one choice in braces; mend or delete it.");
  }

  void allow(const std::vector<std::string>& keys) const {
    for (const auto& [key, value] : json_.items()) {
      if (std::find(keys.begin(), keys.end(), key) == keys.end())
        refuse(fmt::format("key \"{}\" is unknown here", key),
               did_you_mean(key, keys) + fmt::format("This action has {}.", fmt::join(keys, ", ")));
    }
  }

  [[nodiscard]] bool has(const char* key) const { return json_.contains(key); }
  [[nodiscard]] std::string shown(const char* key) const { return json_.at(key).dump(); }

  [[nodiscard]] std::string text(const char* key, const char* remedy) const {
    if (!has(key)) refuse(fmt::format("\"{}\" is missing", key), remedy);
    if (!json_.at(key).is_string())
      refuse(fmt::format("\"{}\" is {}, which is no text", key, shown(key)), remedy);
    return json_.at(key).get<std::string>();
  }

  [[nodiscard]] int whole(const char* key, const char* remedy) const {
    if (!has(key)) refuse(fmt::format("\"{}\" is missing", key), remedy);
    const Json& value = json_.at(key);
    if (!value.is_number_integer() || std::abs(value.get<double>()) > 1e6)
      refuse(fmt::format("\"{}\" is {}, which is no whole number in reach", key, shown(key)), remedy);
    return value.get<int>();
  }

  [[nodiscard]] double number(const char* key, const char* remedy) const {
    if (!has(key)) refuse(fmt::format("\"{}\" is missing", key), remedy);
    const Json& value = json_.at(key);
    if (!value.is_number() || std::abs(value.get<double>()) > 1e6)
      refuse(fmt::format("\"{}\" is {}, which is no number in reach", key, shown(key)), remedy);
    return value.get<double>();
  }

  [[nodiscard]] std::vector<Eigen::Vector2d> points(size_t least) const {
    const char* remedy =
        "Points are pixels, column and row from the first pixel's centre: [[48.2, 30.1], [50, 33]].";
    if (!has("points")) refuse("\"points\" are missing", remedy);
    const Json& list = json_.at("points");
    if (!list.is_array()) refuse(fmt::format("\"points\" are {}, which is no list", shown("points")), remedy);
    std::vector<Eigen::Vector2d> points;
    for (const Json& point : list) {
      if (!point.is_array() || point.size() != 2 || !point[0].is_number() || !point[1].is_number())
        refuse(fmt::format("{} is no point", point.dump()), remedy);
      points.emplace_back(point[0].get<double>(), point[1].get<double>());
    }
    if (points.size() < least)
      refuse(fmt::format("has {} points", points.size()),
             fmt::format("This action needs {} at least.", least));
    return points;
  }

  [[nodiscard]] std::optional<int> phase_or_all() const {
    if (has("phase") && json_.at("phase") == "all") return std::nullopt;
    return whole("phase", "A phase is a number from 1, or \"all\" for a mask.");
  }

 private:
  const std::filesystem::path& file_;
  size_t number_;
  Json json_;
};

ManualEdit edit_of(const EditLine& line, EditAction action, size_t number, const std::string& text) {
  ManualEdit edit;
  edit.text = text;
  edit.file_line = number;
  edit.action = action;
  edit.slice =
      line.text("slice", "A slice bears the name that `track --json` prints: \"series 2, slice 1\".");
  const char* phase_remedy = "A phase is a number from 1.";
  switch (action) {
    case EditAction::line:
      line.allow({"action", "slice", "direction", "phase", "tag", "points"});
      edit.phase = line.whole("phase", phase_remedy);
      if (line.has("direction"))
        edit.direction =
            line.whole("direction", "Directions are numbered from 1, as `track --json` lists them.");
      edit.tag = line.whole(
          "tag", "A tag's number is shown at its line, on the page of `track --page` and by `desk`.");
      edit.points_px = line.points(1);
      break;
    case EditAction::mask:
      line.allow({"action", "slice", "phase", "points"});
      edit.phase = line.phase_or_all();
      edit.points_px = line.points(3);
      break;
    case EditAction::contour: {
      line.allow({"action", "slice", "phase", "contour", "points"});
      edit.phase = line.whole("phase", phase_remedy);
      const char* remedy = "A contour is \"inner\" or \"outer\".";
      const std::string which = line.text("contour", remedy);
      if (which != "inner" && which != "outer")
        line.refuse(fmt::format("contour \"{}\" is unknown", which), remedy);
      edit.is_outer = which == "outer";
      edit.points_px = line.points(3);
      break;
    }
    case EditAction::height:
      line.allow({"action", "slice", "height_mm"});
      edit.height_mm = line.number(
          "height_mm",
          "It is how far the slice lies over the specimen's mid-height, in mm; 0 if it lies there.");
  }
  return edit;
}

void undo(const EditLine& line, ManualEdits& edits) {
  line.allow({"action", "line"});
  if (edits.standing.empty()) line.refuse("nothing is left to undo", "Delete this line.");
  auto revoked = std::prev(edits.standing.end());
  if (line.has("line")) {
    const int wanted = line.whole("line", "It is the number of a line above this one.");
    revoked = std::find_if(edits.standing.begin(), edits.standing.end(), [&](const ManualEdit& edit) {
      return static_cast<int>(edit.file_line) == wanted;
    });
    if (revoked == edits.standing.end())
      line.refuse(fmt::format("line {} is no choice that stands", wanted),
                  "Name a line above that was not undone before, or none for the last.");
  }
  edits.standing.erase(revoked);
  ++edits.undone;
}

/// Pixels whose centres lie within a closed polygon (even-odd rule).
PixelMask inside(const std::vector<Eigen::Vector2d>& polygon_px, const SlicePlane& plane) {
  PixelMask mask = PixelMask::Constant(plane.rows, plane.columns, false);
  for (int row = 0; row < plane.rows; ++row) {
    std::vector<double> crossings;
    for (size_t i = 0; i < polygon_px.size(); ++i) {
      const Eigen::Vector2d& a = polygon_px[i];
      const Eigen::Vector2d& b = polygon_px[(i + 1) % polygon_px.size()];
      if ((a.y() <= row) == (b.y() <= row)) continue;
      crossings.push_back(a.x() + (row - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
    }
    std::sort(crossings.begin(), crossings.end());
    for (size_t i = 0; i + 1 < crossings.size(); i += 2) {
      const int from = std::max(0, static_cast<int>(std::ceil(crossings[i])));
      const int to = std::min(plane.columns - 1, static_cast<int>(std::floor(crossings[i + 1])));
      for (int column = from; column <= to; ++column)
        mask(row, column) = true;
    }
  }
  return mask;
}

/// A choice beside the view that it is about.
class Application {
 public:
  Application(const ManualEdits& edits, const ManualEdit& edit) : edits_(edits), edit_(edit) {}

  void to(std::vector<TagView>& views) const {
    TagView& view = view_of(views);
    if (edit_.action == EditAction::height) {
      view.height_mm = edit_.height_mm;
      return;
    }
    require_inside(view.plane);
    if (edit_.action == EditAction::line) return see_tag(view, phase_of(view));
    const PixelMask mask = inside(edit_.points_px, view.plane);
    if (edit_.action == EditAction::contour) {
      PhaseEdits& phase = view.edits[phase_of(view)];
      (edit_.is_outer ? phase.within_outer : phase.within_inner) = mask;
      return;
    }
    const size_t first = edit_.phase ? phase_of(view) : 0;
    const size_t end = edit_.phase ? first + 1 : view.edits.size();
    for (size_t k = first; k < end; ++k) {
      PixelMask& masked = view.edits[k].masked;
      masked = masked.size() == 0 ? mask : PixelMask(masked || mask);
    }
  }

 private:
  [[noreturn]] void refuse(const std::string& problem, const std::string& remedy) const {
    EditLine(edits_.file, edit_.file_line).refuse(problem, remedy);
  }

  TagView& view_of(std::vector<TagView>& views) const {
    const auto found = std::find_if(views.begin(), views.end(),
                                    [&](const TagView& view) { return view.name == edit_.slice; });
    if (found != views.end()) return *found;
    std::vector<std::string> names;
    for (const TagView& view : views)
      names.push_back(view.name);
    refuse(fmt::format("slice \"{}\" is not among the tagged ones", edit_.slice),
           did_you_mean(edit_.slice, names) + fmt::format("There are: {}.", fmt::join(names, "; ")));
  }

  size_t phase_of(const TagView& view) const {
    const auto found = std::find(view.frames.begin(), view.frames.end(), *edit_.phase);
    if (found == view.frames.end())
      refuse(fmt::format("phase {} is not in {}", *edit_.phase, view.name),
             fmt::format("It has the phases {}.", fmt::join(view.frames, ", ")));
    return static_cast<size_t>(found - view.frames.begin());
  }

  void require_inside(const SlicePlane& plane) const {
    for (const Eigen::Vector2d& point : edit_.points_px) {
      if (point.x() >= -0.5 && point.y() >= -0.5 && point.x() <= plane.columns - 0.5 &&
          point.y() <= plane.rows - 0.5)
        continue;
      refuse(fmt::format("point [{:g}, {:g}] lies outside the image", point.x(), point.y()),
             fmt::format("Columns are 0 to {}, rows 0 to {}.", plane.columns - 1, plane.rows - 1));
    }
  }

  size_t direction_of(const TagView& view) const {
    if (!edit_.direction && view.waves.size() > 1)
      refuse("\"direction\" is missing",
             fmt::format("{} has {} directions of tags, numbered from 1.", view.name, view.waves.size()));
    const int direction = edit_.direction.value_or(1);
    if (direction < 1 || direction > static_cast<int>(view.waves.size()))
      refuse(fmt::format("direction {} is not in {}", direction, view.name),
             fmt::format("It has {}, numbered from 1.", view.waves.size()));
    return static_cast<size_t>(direction - 1);
  }

  /// Of the line that was drawn a place each tag spacing counts, so that what it weighs does not depend on how densely it was drawn;
  /// places within a spacing of it that were seen before of the same tag count no more.
  void see_tag(TagView& view, size_t phase) const {
    const size_t direction = direction_of(view);
    const TagWave& wave = view.waves[direction];
    const double spacing_mm = wave.spacing_mm();
    double least = 1e300, most = -1e300;
    for (const double across : {0.0, 1.0}) {
      for (const double down : {0.0, 1.0}) {
        const double cycles = wave.per_mm.dot(Eigen::Vector2d(across, down).cwiseProduct(view.extent_mm()));
        least = std::min(least, cycles - wave.offset_cycles);
        most = std::max(most, cycles - wave.offset_cycles);
      }
    }
    if (edit_.tag < least - 1 || edit_.tag > most + 1)
      refuse(fmt::format("tag {} is not in {}", edit_.tag, view.name),
             fmt::format("Tags {} to {} cross it in this direction.", std::lround(std::ceil(least)),
                         std::lround(std::floor(most))));
    std::vector<SeenTag> seen;
    const auto see = [&](const Eigen::Vector2d& x_mm) {
      seen.push_back({static_cast<int>(direction), edit_.tag, x_mm});
    };
    const Eigen::Vector2d pixel_mm(view.plane.column_spacing_mm, view.plane.row_spacing_mm);
    double since_mm = spacing_mm;
    for (size_t i = 0; i < edit_.points_px.size(); ++i) {
      const Eigen::Vector2d here = edit_.points_px[i].cwiseProduct(pixel_mm);
      if (i == 0) {
        see(here);
        since_mm = 0;
        continue;
      }
      const Eigen::Vector2d before = edit_.points_px[i - 1].cwiseProduct(pixel_mm);
      const double length_mm = (here - before).norm();
      double at_mm = spacing_mm - since_mm;
      for (; at_mm <= length_mm; at_mm += spacing_mm)
        see(before + at_mm / length_mm * (here - before));
      since_mm = length_mm - (at_mm - spacing_mm);
    }
    std::vector<SeenTag>& all = view.edits[phase].seen;
    std::erase_if(all, [&](const SeenTag& old) {
      return old.direction == static_cast<int>(direction) && old.tag == edit_.tag &&
             std::any_of(seen.begin(), seen.end(),
                         [&](const SeenTag& place) { return (place.x_mm - old.x_mm).norm() < spacing_mm; });
    });
    all.insert(all.end(), seen.begin(), seen.end());
  }

  const ManualEdits& edits_;
  const ManualEdit& edit_;
};

}  // namespace

std::filesystem::path edits_beside(const std::filesystem::path& folder) {
  return beside(folder, ".edits.jsonl");
}

ManualEdits parse_edits(std::string_view text, const std::filesystem::path& file) {
  ManualEdits edits{file, {}, 0};
  for (size_t number = 1; !text.empty(); ++number) {
    const size_t end = std::min(text.find('\n'), text.size());
    const std::string one(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (one.find_first_not_of(" \t\r") == std::string::npos) continue;
    EditLine line(edits.file, number);
    line.parse(one);
    const char* remedy = "An action is line, mask, contour, height or undo.";
    const std::string action = line.text("action", remedy);
    const auto known = std::find(action_names.begin(), action_names.end(), action);
    if (action == "undo") {
      undo(line, edits);
    } else if (known == action_names.end()) {
      line.refuse(fmt::format("action \"{}\" is unknown", action), remedy);
    } else {
      edits.standing.push_back(
          edit_of(line, static_cast<EditAction>(known - action_names.begin()), number, one));
    }
  }
  return edits;
}

void apply_edits(const ManualEdits& edits, std::vector<TagView>& views) {
  for (TagView& view : views) {
    view.edits.assign(view.images.size(), {});
    view.height_mm.reset();
  }
  for (const ManualEdit& edit : edits.standing)
    Application(edits, edit).to(views);
}

std::map<std::string, size_t> counts_of(const ManualEdits& edits) {
  std::map<std::string, size_t> counts;
  for (const ManualEdit& edit : edits.standing)
    ++counts[action_names[static_cast<size_t>(edit.action)]];
  return counts;
}

}  // namespace diastole::imaging
