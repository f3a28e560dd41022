#include "firmware/core/program_store.hpp"

namespace diastole::firmware {

void ProgramStore::use(const wire::MachineSettings& machine, bool written) {
  machine_ = machine;
  machine_written_ = written;
  backlash_steps_ = written ? wire::backlash_microsteps(machine) : 0;
  configured_ = false;
  program_.size = 0;
  program_.r_wave_us = static_cast<std::uint32_t>(machine.r_wave_us);
}

PlanRefusal ProgramStore::configure(const wire::Configure& configure) {
  if (machine_written_) {
    const PlanRefusal refusal = check_configuration(configure, machine_);
    if (refusal.refusal != wire::Refusal::none) return refusal;
  }
  settings_ = Settings(configure);
  configured_ = true;
  clear();
  return {};
}

void ProgramStore::clear() {
  program_.size = 0;
  waveforms_.clear();
}

wire::Refusal ProgramStore::add(const wire::AddSegment& add) {
  if (program_.size == Program::kMaxSegments) return wire::Refusal::program_full;
  const UploadedWaveform* uploaded = nullptr;
  if (add.waveform == wire::Waveform::uploaded) {
    uploaded = waveforms_.find(add.upload);
    if (uploaded == nullptr) return wire::Refusal::waveform_missing;
  }
  program_.segments[program_.size++] = {add.waveform,  add.cycles,    add.stroke_nL,
                                        add.offset_nL, add.period_us, uploaded};
  return wire::Refusal::none;
}

wire::Refusal ProgramStore::upload(const wire::UploadWaveform& upload) {
  return waveforms_.begin(upload.waveform, upload.points, upload.crc);
}

wire::Refusal ProgramStore::upload(const wire::WaveformPoints& points) {
  return waveforms_.append(points.first, std::span(points.rise).first(points.count));
}

PlanRefusal ProgramStore::arm(const wire::Arm& arm) {
  program_.gate_every = arm.gate_every;
  program_.rest_us = arm.rest_us;
  program_.ttl_width_us = arm.ttl_width_us;
  program_.trigger_delay_us = arm.trigger_delay_us;
  program_.position_period_ticks = arm.position_period_ticks;
  const auto stopping_time = check_program(program_, settings_);
  if (!stopping_time.ok()) return stopping_time.error();
  const auto window_us = check_compensation(program_, settings_, backlash_steps_);
  if (!window_us.ok()) return window_us.error();
  stopping_time_ = *stopping_time;
  compensation_window_ = microseconds(*window_us);
  return {};
}

}  // namespace diastole::firmware
