#include "estimator/imaging/geometry/guide_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole::imaging {
namespace {

constexpr std::array<std::pair<std::string_view, GuideSurface>, 5> surface_names{
    {{"endo", GuideSurface::endo},
     {"epi", GuideSurface::epi},
     {"base", GuideSurface::base},
     {"apex_endo", GuideSurface::apex_endo},
     {"apex_epi", GuideSurface::apex_epi}}};

/// biv-me's contours that bound the left ventricle. The septum's right side is the left ventricle's outer wall.
constexpr std::array<std::pair<std::string_view, GuideSurface>, 9> gpfile_contours{
    {{"SAX_LV_ENDOCARDIAL", GuideSurface::endo},
     {"LAX_LV_ENDOCARDIAL", GuideSurface::endo},
     {"SAX_LV_EPICARDIAL", GuideSurface::epi},
     {"LAX_LV_EPICARDIAL", GuideSurface::epi},
     {"SAX_RV_SEPTUM", GuideSurface::epi},
     {"LAX_RV_SEPTUM", GuideSurface::epi},
     {"MITRAL_VALVE", GuideSurface::base},
     {"APEX_ENDO_POINT", GuideSurface::apex_endo},
     {"APEX_POINT", GuideSurface::apex_epi}}};

constexpr const char* csv_remedy =
    "A row is phase,slice,surface,x_mm,y_mm,z_mm,sigma_mm, like 0,sa03,endo,-36.279,-1.137,-70.868,0.5.";
constexpr const char* gpfile_remedy =
    "A row is x y z contour-type sliceID weight frame, like -36.3 -1.1 -70.9 SAX_LV_ENDOCARDIAL 3 1 0.";

bool is_same_word(std::string_view a, std::string_view b) {
  return in_small_letters(a) == in_small_letters(b);
}

struct Line {
  std::string_view file;
  size_t number;
  const char* remedy;

  [[noreturn]] void fail(std::string_view column, const std::string& problem) const {
    throw InputError({std::string(file),
                      fmt::format("line {}{}{}", number, column.empty() ? "" : ", column ", column), problem,
                      remedy});
  }
  [[nodiscard]] double number_in(std::string_view text, std::string_view column) const {
    const auto value = parse_number<double>(text);
    if (!value || !std::isfinite(*value)) fail(column, fmt::format("\"{}\" is not a number", text));
    return *value;
  }
  [[nodiscard]] double coordinate_in(std::string_view text, std::string_view column) const {
    constexpr double farthest_mm = 1e5;  // no scanner reaches so far
    const double value = number_in(text, column);
    if (std::abs(value) > farthest_mm) fail(column, fmt::format("{} mm lies outside any scanner", text));
    return value;
  }
  [[nodiscard]] int count_in(std::string_view text, std::string_view column) const {
    const double value = number_in(text, column);
    constexpr double most = 100000;  // phases of a cine: a number beyond is another column
    if (value < 0 || value > most || value != std::floor(value))
      fail(column, fmt::format("{} is not a whole number from 0 on", text));
    return static_cast<int>(value);
  }
};

std::vector<std::string_view> split(std::string_view line, std::string_view separators, bool joins) {
  std::vector<std::string_view> fields;
  while (true) {
    const size_t end = line.find_first_of(separators);
    const std::string_view field = line.substr(0, end);
    if (!joins || !field.empty()) fields.push_back(field);
    if (end == std::string_view::npos) return fields;
    line.remove_prefix(end + 1);
  }
}

/// Rows with the file's own numbers of phases, gathered and then put in order.
class Gatherer {
 public:
  explicit Gatherer(const std::string& file) { guide_.file = file; }

  void add(int phase, std::string_view slice, GuideSurface surface, const Eigen::Vector3d& place_mm,
           double sigma_mm) {
    const auto known = std::find(guide_.slices.begin(), guide_.slices.end(), slice);
    const auto index = static_cast<size_t>(known - guide_.slices.begin());
    if (known == guide_.slices.end()) guide_.slices.emplace_back(slice);
    numbers_.insert(phase);
    rows_.push_back(phase);
    guide_.points.push_back({0, index, surface, place_mm, sigma_mm});
  }
  void note_default_sigma(double sigma_mm) {
    guide_.findings.push_back({Severity::note, "default-sigma",
                               fmt::format("no sigma_mm is stated: it is taken as {:g} mm", sigma_mm),
                               guide_.file, sigma_mm, "mm", "Add a column sigma_mm."});
  }
  void leave_out(std::string_view contour) { ++left_out_[std::string(contour)]; }

  GuidePoints done() {
    guide_.phases.assign(numbers_.begin(), numbers_.end());
    for (size_t i = 0; i < rows_.size(); ++i)
      guide_.points[i].phase = static_cast<size_t>(
          std::lower_bound(guide_.phases.begin(), guide_.phases.end(), rows_[i]) - guide_.phases.begin());
    for (const auto& [contour, count] : left_out_)
      guide_.findings.push_back(
          {Severity::note, "other-contour",
           fmt::format("{} points of {} bound no left ventricle and are left out", count, contour),
           guide_.file, static_cast<double>(count), "", ""});
    if (guide_.points.empty())
      throw InputError({guide_.file, "", "holds no guide points of a left ventricle",
                        "Give points of the surfaces endo, epi and base."});
    return guide_;
  }

 private:
  GuidePoints guide_;
  std::set<int> numbers_;
  std::vector<int> rows_;
  std::map<std::string, size_t> left_out_;
};

/// Where the columns of guide_file_mark stand in a table's rows.
struct CsvColumns {
  std::array<std::optional<size_t>, 7> at;
  size_t count = 0;
  double default_sigma_mm;

  [[nodiscard]] bool has_sigma() const { return at[6].has_value(); }
};

/// None where this is no header: each column once, all but sigma_mm, and no other.
std::optional<CsvColumns> csv_columns(std::string_view header, double default_sigma_mm) {
  const std::vector<std::string_view> known = split(guide_file_mark, ",", false);
  const std::vector<std::string_view> given = split(header, ",", false);
  CsvColumns columns{{}, given.size(), default_sigma_mm};
  for (size_t i = 0; i < given.size(); ++i) {
    const auto name = std::find(known.begin(), known.end(), trimmed(given[i]));
    if (name == known.end()) return std::nullopt;
    std::optional<size_t>& at = columns.at[static_cast<size_t>(name - known.begin())];
    if (at) return std::nullopt;
    at = i;
  }
  for (size_t i = 0; i < 6; ++i)
    if (!columns.at[i]) return std::nullopt;
  return columns;
}

void add_csv_row(Gatherer& gatherer, const Line& line, std::string_view text, const CsvColumns& columns) {
  const std::vector<std::string_view> fields = split(text, ",", false);
  if (fields.size() != columns.count)
    line.fail("", fmt::format("has {} columns instead of {}", fields.size(), columns.count));
  const auto field = [&](size_t column) { return trimmed(fields[*columns.at[column]]); };
  const std::optional<GuideSurface> surface = surface_named(field(2));
  if (!surface)
    line.fail("surface", fmt::format("\"{}\" is none of endo, epi, base, apex_endo, apex_epi", field(2)));
  if (field(1).empty()) line.fail("slice", "is empty");
  const double sigma_mm =
      columns.has_sigma() ? line.number_in(field(6), "sigma_mm") : columns.default_sigma_mm;
  if (!(sigma_mm > 0)) line.fail("sigma_mm", fmt::format("{} is not above 0", field(6)));
  gatherer.add(line.count_in(field(0), "phase"), field(1), *surface,
               {line.coordinate_in(field(3), "x_mm"), line.coordinate_in(field(4), "y_mm"),
                line.coordinate_in(field(5), "z_mm")},
               sigma_mm);
}

void add_gpfile_row(Gatherer& gatherer, const Line& line, std::string_view text, double sigma_mm) {
  const std::vector<std::string_view> fields = split(text, " \t", true);
  if (fields.size() != 6 && fields.size() != 7)
    line.fail("", fmt::format("has {} columns instead of 7", fields.size()));
  const Eigen::Vector3d place_mm(line.coordinate_in(fields[0], "x"), line.coordinate_in(fields[1], "y"),
                                 line.coordinate_in(fields[2], "z"));
  const int frame = line.count_in(fields.back(), "frame");
  const double weight = fields.size() == 7 ? line.number_in(fields[5], "weight") : 1.0;
  if (weight < 0) line.fail("weight", fmt::format("{} is negative", fields[5]));
  const auto* contour = std::find_if(gpfile_contours.begin(), gpfile_contours.end(),
                                     [&](const auto& name) { return is_same_word(name.first, fields[3]); });
  if (contour == gpfile_contours.end() || weight == 0) {
    gatherer.leave_out(weight == 0 ? "weight 0" : fields[3]);
    return;
  }
  // A weight multiplies a point's square in the sum of squares.
  gatherer.add(frame, fields[4], contour->second, place_mm, sigma_mm / std::sqrt(weight));
}

}  // namespace

std::string_view name_of(GuideSurface surface) {
  return std::find_if(surface_names.begin(), surface_names.end(),
                      [&](const auto& name) { return name.second == surface; })
      ->first;
}

std::optional<GuideSurface> surface_named(std::string_view name) {
  for (const auto& [word, surface] : surface_names)
    if (is_same_word(word, name)) return surface;
  return std::nullopt;
}

bool is_guide_table(std::string_view text) {
  text = without_byte_order_mark(text);
  return csv_columns(trimmed(text.substr(0, text.find('\n'))), click_sigma_mm).has_value();
}

GuidePoints guide_points_from_text(std::string_view text, const std::string& file, double default_sigma_mm) {
  Gatherer gatherer(file);
  std::optional<CsvColumns> columns;
  bool is_first = true;
  text = without_byte_order_mark(text);
  size_t number = 0;
  while (!text.empty()) {
    const size_t end = text.find('\n');
    std::string_view row = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++number;
    if (row.ends_with('\r')) row.remove_suffix(1);
    if (row.find_first_not_of(" \t") == std::string_view::npos) continue;
    if (is_first) {
      is_first = false;
      columns = csv_columns(row, default_sigma_mm);
      if (columns && !columns->has_sigma()) gatherer.note_default_sigma(default_sigma_mm);
      if (columns) continue;
      const std::vector<std::string_view> fields = split(row, " \t", true);
      const bool is_header = fields.size() >= 6 && fields[0] == "x" && fields[1] == "y" && fields[2] == "z";
      if (is_header) continue;
      if (fields.size() < 6)
        throw InputError(
            {file, fmt::format("line {}", number), fmt::format("\"{}\" is no header of guide points", row),
             fmt::format("The first line is {} or, in a GPFile, x y z contour-type sliceID weight frame.",
                         guide_file_mark)});
    }
    if (columns) {
      add_csv_row(gatherer, {file, number, csv_remedy}, row, *columns);
    } else {
      add_gpfile_row(gatherer, {file, number, gpfile_remedy}, row, default_sigma_mm);
    }
  }
  return gatherer.done();
}

GuidePoints read_guide_points(const std::filesystem::path& path) {
  return guide_points_from_text(
      read_whole_file(path, "Give a table of guide points (*.guide.csv) or biv-me's GPFile."), path.string());
}

std::string guide_file_text(const GuidePoints& guide) {
  std::string text = std::string(guide_file_mark) + "\n";
  for (const GuidePoint& point : guide.points)
    text += fmt::format("{},{},{},{:.3f},{:.3f},{:.3f},{:g}\n", guide.phases[point.phase],
                        guide.slices[point.slice], name_of(point.surface), point.place_mm.x(),
                        point.place_mm.y(), point.place_mm.z(), point.sigma_mm);
  return text;
}

}  // namespace diastole::imaging
