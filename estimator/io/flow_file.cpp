#include "estimator/io/flow_file.hpp"

#include "estimator/io/finding_json.hpp"
#include "estimator/io/record_file.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {

DIASTOLE_MEMBERS(FlowPhaseRecord, phase_s, flow_mL_s, flow_sigma_mL_s, volume_mL, volume_sigma_mL, core_cm_s,
                 turns)
DIASTOLE_MEMBERS(FlowImageRecord, phase_s, magnitude, velocity, outline)
DIASTOLE_MEMBERS(LoopPointRecord, phase_s, volume_mL, volume_sigma_mL, pressure_kPa, pressure_sigma_kPa,
                 stiffness_kPa_per_mL, stiffness_sigma_kPa_per_mL)
DIASTOLE_MEMBERS(FlowRecord, folder, series, venc_cm_s, venc_source, interval_s, stroke_mL, stroke_sigma_mL,
                 closure_mL, closure_sigma_mL, is_closed, background_order, background_cm_s,
                 background_sigma_cm_s, unwrapped, area_mm2, movement_mm, reduced_chi_square, phases, time_s,
                 flow_mL_s, flow_sigma_mL_s, volume_mL, volume_sigma_mL, pressure_source, work_mJ,
                 work_sigma_mJ, loop, rows, columns, images, findings)

namespace {

constexpr RecordFormat flow_format{
    flow_record_mark, "a measured flow",
    "Give a file that `diastole flow FOLDER -o NAME.flow.csv --record NAME.json` wrote."};

void require_whole(const FlowRecord& record) {
  for (const auto* series :
       {&record.flow_mL_s, &record.flow_sigma_mL_s, &record.volume_mL, &record.volume_sigma_mL})
    if (series->size() != record.time_s.size())
      throw std::invalid_argument("the cycle's series are not of one length");
  if (record.phases.empty() || record.time_s.empty()) throw std::invalid_argument("there are no phases");
  if (record.rows < 1 || record.columns < 1) throw std::invalid_argument("the images have no size");
  const size_t pixels = static_cast<size_t>(record.rows) * static_cast<size_t>(record.columns);
  for (const FlowImageRecord& image : record.images) {
    if (image.magnitude.size() != 4 * ((pixels + 2) / 3) || image.velocity.size() != image.magnitude.size())
      throw std::invalid_argument("a picture has not as many pixels as its window");
    if (image.outline.size() % 2 != 0) throw std::invalid_argument("an outline is not whole");
  }
}

}  // namespace

std::string to_json(const FlowRecord& record) {
  return json_text(flow_format.document(written(record))) + "\n";
}

bool is_flow(std::string_view text) { return flow_format.marks(text); }

FlowRecord flow_record_from_json(std::string_view text, const std::string& file) {
  FlowRecord record;
  flow_format.read(text, file, [&](const Json& json) {
    read_json(json, record);
    require_whole(record);
  });
  return record;
}

}  // namespace diastole
