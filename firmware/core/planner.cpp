#include "firmware/core/planner.hpp"

#include <algorithm>

namespace diastole::firmware {

namespace {

Ticks at_phase(Ticks length, Q64 phase) {
  return {static_cast<std::int64_t>(scale(static_cast<std::uint64_t>(length.count), phase))};
}

/// Where the cycles of a segment begin: at its least volume.
Steps beginning_of(const Segment& segment, const Settings& settings) {
  const std::uint32_t above_nL = segment.moves() ? 0 : segment.stroke_nL;
  return settings.steps_of_nL(std::uint64_t{segment.offset_nL} + above_nL);
}

}  // namespace

void Planner::begin_run(const Program& program, const Settings& settings, Ticks start, Steps position) {
  program_ = &program;
  settings_ = settings;
  origin_ = start;
  position_ = position;
  segment_ = 0;
  cycle_in_run_ = 0;
  stop_at_cycle_end_ = false;
  last_ = before_last_ = {};
  phase_ = Phase::run_start;
  plan_next();
}

void Planner::begin_move(bool inflate, const RestToRestMove& move, Ticks start) {
  origin_ = start;
  move_ = move;
  length_ = move.duration();
  inflate_ = inflate;
  count_ = move.count();
  index_ = 0;
  last_ = before_last_ = {};
  phase_ = Phase::move;
  plan_next();
}

void Planner::begin_stop(Ticks earliest, std::uint64_t deceleration_steps_per_s2, bool turning) {
  if (next_.flags == 0) return;
  phase_ = Phase::stop;
  index_ = count_ = 0;
  if (next_.has(MotionEvent::kRunStart)) {
    origin_ = next_.tick + kRestBeforeEnd;
    return;
  }
  if (last_interval() > Ticks{0} && !turning) {
    const Ticks interval = std::max(last_interval(), earliest - last_.tick);
    const std::uint64_t speed = static_cast<std::uint64_t>(kTicksPerSecond / interval.count + 1);
    count_ = static_cast<std::uint32_t>((speed * speed + deceleration_steps_per_s2 - 1) /
                                        (2 * deceleration_steps_per_s2));
    inflate_ = last_.has(MotionEvent::kInflate);
    length_ = interval * (2 * std::int64_t{count_} + 1);
    if (count_ > 0) level_ = SteppedFraction(2 * count_ - 1, 2 * count_ + 1);
  }
  origin_ = count_ > 0 ? last_.tick : std::max(earliest, last_.tick + kRestBeforeEnd);
  plan_next();
}

/// Between the last two steps if they went the same way; 0 at rest and at a turning point.
Ticks Planner::last_interval() const {
  constexpr std::uint16_t kWay = MotionEvent::kStep | MotionEvent::kInflate;
  const bool goes_on = last_.has(MotionEvent::kStep) && ((last_.flags ^ before_last_.flags) & kWay) == 0;
  return goes_on ? last_.tick - before_last_.tick : Ticks{0};
}

void Planner::begin_ramp(Steps to, Phase then) {
  const Steps distance = to - position_;
  after_ramp_ = then;
  phase_ = Phase::ramp;
  inflate_ = distance.count > 0;
  count_ = static_cast<std::uint32_t>(inflate_ ? distance.count : -distance.count);
  index_ = 0;
  length_ = count_ > 0 ? settings_.ramp_time(distance) : Ticks{0};
  if (count_ > 0) level_ = SteppedFraction(1, 2 * count_);
  position_ = to;
}

void Planner::end_ramp() {
  origin_ += length_;
  phase_ = after_ramp_;
}

void Planner::end_steps(Ticks duration) {
  origin_ += duration;
  phase_ = Phase::end;
}

void Planner::begin_segment() {
  const Segment& segment = program_->segments[segment_];
  profile_ = find_profile(segment.waveform);
  count_ = segment.moves() ? static_cast<std::uint32_t>(settings_.steps_of_nL(segment.stroke_nL).count) : 0;
  length_ = microseconds(segment.period_us);
  if (segment.uploaded != nullptr)
    crossings_ = UploadedCrossings(*segment.uploaded, count_);
  else if (count_ > 0)
    level_ = SteppedFraction(1, 2 * count_);
  cycle_ = index_ = 0;
  phase_ = Phase::cycles;
}

MotionEvent Planner::ramp_step() {
  // The rising half of a parabolic cycle twice as long as the ramp.
  const Ticks time = at_phase(length_ * 2, parabolic_profile.phase_rising(level_.value()));
  level_.up();
  ++index_;
  return {origin_ + time,
          static_cast<std::uint16_t>(MotionEvent::kStep | (inflate_ ? MotionEvent::kInflate : 0))};
}

std::uint16_t Planner::cycle_start_flags() const {
  const bool r_wave = cycle_in_run_ % program_->gate_every == 0;
  return static_cast<std::uint16_t>(MotionEvent::kCycleStart | (r_wave ? MotionEvent::kRWave : 0));
}

/// A cycle without steps: its start, then its end.
MotionEvent Planner::still_cycle_mark() {
  if (index_++ == 0) return {origin_, cycle_start_flags()};
  const Ticks end = origin_ + length_ - std::min(kRestBeforeEnd, Ticks{length_.count / 2});
  finish_cycle();
  return {end, MotionEvent::kCycleEnd};
}

MotionEvent Planner::cycle_step() {
  const bool rising = index_ < count_;
  const Q64 y = level_.value();
  const Q64 phase = rising ? profile_->phase_rising(y) : profile_->phase_falling(y);
  MotionEvent event{origin_ + at_phase(length_, phase), MotionEvent::kStep};
  if (rising) event.flags |= MotionEvent::kInflate;
  if (index_ == 0) event.flags |= cycle_start_flags();
  // The highest level is crossed twice running, up and down; so is the lowest, down and up.
  if (++index_ < count_)
    level_.up();
  else if (index_ > count_ && index_ < 2 * count_)
    level_.down();
  if (index_ == 2 * count_) {
    event.flags |= MotionEvent::kCycleEnd;
    finish_cycle();
  }
  return event;
}

MotionEvent Planner::uploaded_step() {
  const UploadedCrossings::Crossing crossing = crossings_.take();
  MotionEvent event{origin_ + at_phase(length_, crossing.phase), MotionEvent::kStep};
  if (crossing.rising) event.flags |= MotionEvent::kInflate;
  if (index_++ == 0) event.flags |= cycle_start_flags();
  if (crossings_.at_end()) {
    event.flags |= MotionEvent::kCycleEnd;
    crossings_.restart();
    finish_cycle();
  }
  return event;
}

void Planner::finish_cycle() {
  origin_ += length_;
  index_ = 0;
  ++cycle_in_run_;
  ++cycle_;
  const bool segment_done = cycle_ == program_->segments[segment_].cycles;
  if (segment_done) ++segment_;
  if (stop_at_cycle_end_ || segment_ == program_->size) {
    begin_ramp(Steps{0}, Phase::end);
  } else if (segment_done) {
    begin_ramp(beginning_of(program_->segments[segment_], settings_), Phase::segment_start);
  }
}

MotionEvent Planner::move_step() {
  return {origin_ + move_.time_of(index_++),
          static_cast<std::uint16_t>(MotionEvent::kStep | (inflate_ ? MotionEvent::kInflate : 0))};
}

MotionEvent Planner::stop_step() {
  ++index_;
  const Q64 speed_left = square_root(level_.value());
  level_.down();
  return {origin_ + at_phase(length_, 0 - speed_left),
          static_cast<std::uint16_t>(MotionEvent::kStep | (inflate_ ? MotionEvent::kInflate : 0))};
}

void Planner::plan_next() {
  next_ = {};
  while (next_.flags == 0 && phase_ != Phase::idle)
    plan_in_phase();
}

/// Either plans an event or moves on to another phase.
void Planner::plan_in_phase() {
  switch (phase_) {
    case Phase::idle:
      break;
    case Phase::run_start:
      next_ = MotionEvent{origin_, MotionEvent::kRunStart};
      begin_ramp(Steps{0}, Phase::rest);
      break;
    case Phase::rest:
      origin_ += microseconds(program_->rest_us);
      begin_ramp(beginning_of(program_->segments[0], settings_), Phase::segment_start);
      break;
    case Phase::ramp:
      if (index_ < count_)
        next_ = ramp_step();
      else
        end_ramp();
      break;
    case Phase::segment_start:
      if (stop_at_cycle_end_) {
        begin_ramp(Steps{0}, Phase::end);
        break;
      }
      next_ = MotionEvent{origin_, MotionEvent::kSegmentStart};
      begin_segment();
      if (count_ == 0) next_.flags |= still_cycle_mark().flags;
      break;
    case Phase::cycles:
      if (count_ > 0)
        next_ = profile_ != nullptr ? cycle_step() : uploaded_step();
      else if (stop_at_cycle_end_ && index_ == 0)
        begin_ramp(Steps{0}, Phase::end);
      else
        next_ = still_cycle_mark();
      break;
    case Phase::move:
      if (index_ < count_)
        next_ = move_step();
      else
        end_steps(length_);
      break;
    case Phase::stop:
      if (index_ < count_)
        next_ = stop_step();
      else
        end_steps(count_ > 0 ? length_ : Ticks{0});
      break;
    case Phase::end:
      next_ = MotionEvent{origin_, MotionEvent::kEnd};
      phase_ = Phase::idle;
      break;
  }
}

Ticks Planner::segment_offset(const Program& program, const Settings& settings, std::size_t segment) {
  Ticks time = microseconds(program.rest_us);
  Steps position{0};
  for (std::size_t i = 0; i <= segment; ++i) {
    const Segment& next = program.segments[i];
    const Steps beginning = beginning_of(next, settings);
    if (beginning != position) time += settings.ramp_time(beginning - position);
    position = beginning;
    if (i < segment) time += microseconds(next.period_us) * std::int64_t{next.cycles};
  }
  return time;
}

}  // namespace diastole::firmware
