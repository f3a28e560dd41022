#pragma once
// What the catalogue knows of one file: of a run, of a fit or an explanation, or of a folder of images.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace diastole::catalogue {

struct Entry {
  std::string path;       ///< from the catalogued folder
  std::string kind;       ///< run, fit, explanation, images
  std::string date = {};  ///< ISO 8601, UTC: a run's start; of other files when they were last written
  std::string specimen = {};
  std::string operator_name = {};
  std::optional<double> room_temperature_C = {};
  std::string protocol = {};  ///< "10 x parabolic 40 mL in 1.2 s"
  std::optional<double> duration_s = {};
  std::optional<int64_t> cycles = {};
  std::optional<double> peak_kPa = {};  ///< of the cavity's pressure
  std::optional<bool> sound = {};       ///< of a run
  std::string problem = {};    ///< the first of those that make it unsound, or why a file cannot be read
  std::string verdict = {};    ///< of an explanation, and of the runs that it explained
  std::string effects = {};    ///< their ids, with commas
  std::string parameter = {};  ///< "C1_kPa"
  std::optional<double> stiffness_kPa = {};
  std::optional<double> stiffness_se_kPa = {};
  std::string notes = {};  ///< one a line
  /// Least and largest pressure (kPa) in each of equal parts of the run, one pair after the other; empty for other kinds.
  std::vector<float> trace = {};
  std::vector<std::string> runs = {};  ///< that a fit or an explanation rests on, as `path`
};

/// What a file is by its name and first bytes.
enum class Candidate { none, run, record };
Candidate candidate_of(const std::filesystem::path& file);

/// Never throws for what a file holds: what cannot be read is an entry with its problem. None if the file is of no kind that
/// the catalogue knows. `file` lies in `folder`.
std::optional<Entry> read_entry(const std::filesystem::path& folder, const std::filesystem::path& file);

/// Of a folder that holds so many DICOM files, the newest written then.
Entry images_entry(const std::filesystem::path& folder, const std::filesystem::path& images, int64_t files,
                   int64_t newest_mtime_ns);

/// The moment as the catalogue writes it.
std::string utc_text(int64_t mtime_ns);

}  // namespace diastole::catalogue
