#include "estimator/io/tracking_file.hpp"

#include <cmath>

#include "estimator/io/finding_json.hpp"
#include "estimator/io/record_file.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {

DIASTOLE_MEMBERS(TrackedDirection, angle_deg, spacing_mm)
template <class Visit, IsRecord<TrackedImage> Record>
void each_member(Visit&& visit, Record& record) {
  DIASTOLE_VISIT(visit, record, frame, trigger_ms, sigma_px, residual, picture, points, rejected)
  visit("outlines", if_any(record.outlines));
}
DIASTOLE_MEMBERS(TrackedSliceImages, name, view, rows, columns, pixel_mm, directions, images)
DIASTOLE_MEMBERS(DroppedCount, reason, points)
template <class Visit, IsRecord<TrackingRecord> Record>
void each_member(Visit&& visit, Record& record) {
  DIASTOLE_VISIT(visit, record, folder, coordinates, points, rms_px, seconds, dropped, findings, slices)
  visit("edits", if_any(record.edits));
}

namespace {

constexpr RecordFormat tracking_format{
    tracking_file_mark, "what was tracked",
    "Give a file that `diastole track FOLDER -o NAME.tags.csv --record NAME.json` wrote."};

void require_whole(const TrackingRecord& record) {
  for (const TrackedSliceImages& slice : record.slices) {
    const size_t pixels = static_cast<size_t>(slice.rows) * static_cast<size_t>(slice.columns);
    for (const TrackedImage& image : slice.images) {
      if (image.picture.size() != 4 * ((pixels + 2) / 3))
        throw std::invalid_argument("a picture has not as many pixels as its slice");
      if (image.points.size() % 5 != 0 || image.rejected.size() % 4 != 0)
        throw std::invalid_argument("a list of points is not whole");
      for (const std::vector<double>& outline : image.outlines) {
        if (outline.size() % 2 != 0) throw std::invalid_argument("an outline is not whole");
      }
    }
  }
}

constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// To a thousandth of a pixel.
double thousandth(double value) { return std::round(value * 1e3) / 1e3; }

}  // namespace

std::string to_json(const TrackingRecord& record) {
  Json json = tracking_format.document(written(record));
  round_numbers(json, thousandth);
  return json_text(json) + "\n";
}

bool is_tracking(std::string_view text) { return tracking_format.marks(text); }

TrackingRecord tracking_record_from_json(std::string_view text, const std::string& file) {
  TrackingRecord record;
  tracking_format.read(text, file, [&](const Json& json) {
    read_json(json, record);
    require_whole(record);
  });
  return record;
}

std::string base64(std::string_view bytes) {
  std::string text;
  text.reserve(4 * ((bytes.size() + 2) / 3));
  for (size_t at = 0; at < bytes.size(); at += 3) {
    unsigned block = 0;
    for (size_t i = 0; i < 3; ++i)
      block = block << 8 | (at + i < bytes.size() ? static_cast<unsigned char>(bytes[at + i]) : 0U);
    for (size_t i = 0; i < 4; ++i)
      text += at + i > bytes.size() ? '=' : letters[block >> (18 - 6 * i) & 63U];
  }
  return text;
}

std::string bytes_of_base64(std::string_view text) {
  std::string bytes;
  unsigned block = 0;
  int bits = 0;
  for (const char letter : text) {
    const size_t value = letters.find(letter);
    if (value == std::string_view::npos) break;
    block = block << 6U | static_cast<unsigned>(value);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(static_cast<unsigned char>(block >> static_cast<unsigned>(bits) & 255U));
  }
  return bytes;
}

}  // namespace diastole
