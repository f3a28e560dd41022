#pragma once
// What was tracked, as pictures and lines: what `diastole track --page` shows and `diastole report` reads again
// (JSON, format "diastole-tracking").

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/io/finding.hpp"

namespace diastole {

inline constexpr std::string_view tracking_file_mark = "diastole-tracking";

struct TrackedDirection {
  double angle_deg = 0;  ///< of the tags' normal from the rows
  double spacing_mm = 0;
};

/// One image of a slice. Places are in pixels from the first pixel's centre: column, row.
struct TrackedImage {
  int frame = 0;
  double trigger_ms = 0;
  double sigma_px = 0;           ///< of its points, RMS
  double residual = 0;           ///< of the fit to the image, in hundredths of its bright values
  std::string picture;           ///< 8 bits a pixel, row by row, base64
  std::vector<double> points;    ///< five numbers each: direction, tag, column, row, sigma in pixels
  std::vector<double> rejected;  ///< four numbers each: direction, reason, column, row
  std::vector<std::vector<double>> outlines = {};  ///< of tissue, closed: column, row, column, row, ...
};

struct TrackedSliceImages {
  std::string name;  ///< "series 2, slice 1"
  std::string view;  ///< "transverse"
  int rows = 0, columns = 0;
  std::array<double, 2> pixel_mm{};  ///< between columns, between rows
  std::vector<TrackedDirection> directions;
  std::vector<TrackedImage> images;
};

struct DroppedCount {
  std::string reason;
  size_t points = 0;
};

struct TrackingRecord {
  std::string folder;
  std::string coordinates;  ///< "specimen" or "patient"
  size_t points = 0;
  double rms_px = 0;
  double seconds = 0;
  std::optional<size_t> edits = {};   ///< manual choices that were applied
  std::vector<DroppedCount> dropped;  ///< a rejected point's reason counts here
  std::vector<Finding> findings;
  std::vector<TrackedSliceImages> slices;
};

std::string to_json(const TrackingRecord& record);
/// Whether text is such a record, by its format.
bool is_tracking(std::string_view text);
/// Throws InputError (file, problem, remedy) unless it is a whole one.
TrackingRecord tracking_record_from_json(std::string_view text, const std::string& file);

/// Base64 (RFC 4648, section 4).
std::string base64(std::string_view bytes);
/// And back; what is no such text ends it.
std::string bytes_of_base64(std::string_view text);

}  // namespace diastole
