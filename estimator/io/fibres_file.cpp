#include "estimator/io/fibres_file.hpp"

#include "estimator/io/finding_json.hpp"
#include "estimator/io/record_file.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {

DIASTOLE_MEMBERS(FibreSliceRecord, angle)
DIASTOLE_MEMBERS(FibreLayerRecord, name, x_mm, y_mm, along_x, along_y, helix_deg)
DIASTOLE_MEMBERS(FibresRecord, folder, series, b_values, directions, volumes, slices, snr, md, fa,
                 fa_of_noise, outliers, axes, axes_agreement, axes_agreement_as_said, wall_voxels, rms_deg,
                 sigma_deg, depth, helix_deg, helix_low_deg, helix_high_deg, layers, rows, columns,
                 pixel_aspect, pictures, findings)

namespace {

constexpr RecordFormat fibres_format{
    fibres_record_mark, "measured fibres",
    "Give a file that `diastole fibres FOLDER -o NAME.fibres.csv --record NAME.json` wrote."};

void require_whole(const FibresRecord& record) {
  for (const auto* series : {&record.helix_deg, &record.helix_low_deg, &record.helix_high_deg})
    if (series->size() != record.depth.size())
      throw std::invalid_argument("the helix's course has series of several lengths");
  for (const FibreLayerRecord& layer : record.layers)
    for (const auto* series : {&layer.y_mm, &layer.along_x, &layer.along_y, &layer.helix_deg})
      if (series->size() != layer.x_mm.size()) throw std::invalid_argument("a layer's strokes are not whole");
  if (record.rows < 1 || record.columns < 1) throw std::invalid_argument("the pictures have no size");
  const size_t pixels = static_cast<size_t>(record.rows) * static_cast<size_t>(record.columns);
  for (const FibreSliceRecord& picture : record.pictures)
    if (picture.angle.size() != 4 * ((pixels + 2) / 3))
      throw std::invalid_argument("a picture has not as many pixels as its slice");
}

}  // namespace

std::string to_json(const FibresRecord& record) {
  return json_text(fibres_format.document(written(record))) + "\n";
}

bool is_fibres(std::string_view text) { return fibres_format.marks(text); }

FibresRecord fibres_record_from_json(std::string_view text, const std::string& file) {
  FibresRecord record;
  fibres_format.read(text, file, [&](const Json& json) {
    read_json(json, record);
    require_whole(record);
  });
  return record;
}

}  // namespace diastole
