#include "host/journal/journal_records.hpp"
#include "protocol/contract/json_text.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace diastole {
namespace {

using nlohmann::json;

constexpr uint64_t most_counts = uint64_t{1} << 40;
constexpr double highest_rate_Hz = 1e12;

/// Puts the fields that describe() names into an object.
class FieldWriter {
 public:
  explicit FieldWriter(json& object) : object_(object) {}
  void fields() {}
  void fields(const char* name, const auto& value, auto&... more) {
    object_[name] = value;
    fields(more...);
  }
  void whole(uint64_t /*most*/, auto&... named) { fields(named...); }
  void later(auto&... named) { fields(named...); }
  void integer(const char* name, double value, double /*least*/) { object_[name] = std::llround(value); }
  void rate(const char* name, double value_Hz) { object_[name] = value_Hz; }
  void if_known(const char* name, const std::optional<uint64_t>& value) {
    if (value) object_[name] = *value;
  }
  void attributes(const char* name, const Attributes& attributes) {
    json& object = object_[name] = json::object();
    for (const auto& [key, value] : attributes)
      std::visit([&object, &at = key](const auto& v) { object[at] = v; }, value);
  }
  template <typename Part>
  void parts(const char* name, std::vector<Part>& parts) {
    json& array = object_[name] = json::array();
    for (Part& part : parts) {
      FieldWriter writer(array.emplace_back(json::object()));
      describe(writer, part);
    }
  }

 private:
  json& object_;
};

/// Takes them out of one; throws json::exception or std::out_of_range where the object is not of that form.
class FieldReader {
 public:
  explicit FieldReader(const json& object) : object_(object) {}
  void fields() {}
  void fields(const char* name, auto& value, auto&... more) {
    object_.at(name).get_to(value);
    fields(more...);
  }
  void whole(uint64_t /*most*/) {}
  /// Others of JSON's numbers would be rounded or wrapped.
  template <typename Whole>
  void whole(uint64_t most, const char* name, Whole& value, auto&... more) {
    const json& number = object_.at(name);
    if (!number.is_number_unsigned() || number.get<uint64_t>() > most) throw std::out_of_range(name);
    value = static_cast<Whole>(number.get<uint64_t>());
    whole(most, more...);
  }
  void later(const char* name, auto& value) {
    if (!object_.contains(name)) return;
    if constexpr (std::is_same_v<decltype(value), int64_t&>)
      whole(most_counts, name, value);
    else
      fields(name, value);
  }
  void later(const char* name, std::vector<uint64_t>& values) {
    if (!object_.contains(name)) return;
    for (const json& number : object_.at(name)) {
      if (!number.is_number_unsigned() || number.get<uint64_t>() > most_counts) throw std::out_of_range(name);
      values.push_back(number.get<uint64_t>());
    }
  }
  void rate(const char* name, double& value_Hz) { integer(name, value_Hz, 1e-3); }
  void integer(const char* name, double& value, double least) {
    object_.at(name).get_to(value);
    if (!(value >= least && value <= highest_rate_Hz)) throw std::out_of_range(name);
  }
  void if_known(const char* name, std::optional<uint64_t>& value) {
    if (object_.contains(name)) whole(most_ticks, name, value.emplace());
  }
  /// What is neither a number nor a text is left out; so is a number that was none when it was written.
  void attributes(const char* name, Attributes& attributes) {
    if (lacks(name)) return;
    for (const auto& [key, value] : object_.at(name).items()) {
      if (value.is_string()) attributes[key] = value.get<std::string>();
      if (value.is_number_integer()) attributes[key] = value.get<int64_t>();
      if (value.is_number_float()) attributes[key] = value.get<double>();
    }
  }
  template <typename Part>
  void parts(const char* name, std::vector<Part>& parts) {
    if (lacks(name)) return;
    for (const json& object : object_.at(name)) {
      FieldReader reader(object);
      describe(reader, parts.emplace_back());
    }
  }

 private:
  static constexpr std::array<std::string_view, 3> added_later{"waveforms", "session", "notes"};
  [[nodiscard]] bool lacks(const char* name) const {
    return std::ranges::find(added_later, name) != added_later.end() && !object_.contains(name);
  }
  const json& object_;
};

// The fields of each kind of document: `later` ones may be absent, `whole` numbers have a bound.

void describe(auto& io, runfile::Segment& segment) {
  io.fields("start_s", segment.start_s, "waveform", segment.waveform, "stroke_mL", segment.stroke_mL,
            "period_s", segment.period_s, "offset_mL", segment.offset_mL);
  io.whole(most_counts, "cycles", segment.cycles);
}

void describe(auto& io, PlayedSegment& played) {
  io.whole(most_counts, "segment", played.segment);
  io.fields("points", played.points, "fraction", played.fraction);
}

void describe(auto& io, runfile::SessionNote& note) {
  io.fields("written_utc", note.written_utc, "author", note.author, "text", note.text);
}

void describe(auto& io, BeginRecord& begin) {
  io.fields("run_id", begin.run_id, "started_utc", begin.started_utc, "producer", begin.producer,
            "experiment", begin.experiment, "channels", begin.channels);
  io.later("experiment_file", begin.experiment_file);
  io.later("instrument", begin.instrument);
  io.rate("sample_rate_Hz", begin.sample_rate_Hz);
  io.attributes("rig", begin.rig);
  io.integer("tick_rate_Hz", begin.tick_rate_Hz, 1e-3);
  io.integer("microstep_pL", begin.microstep_pL, 0);
  io.rate("daq_timer_rate_Hz", begin.daq_timer_rate_Hz);
  io.later("daq_timer_counts_samples", begin.daq_timer_counts_samples);
  io.parts("segments", begin.segments);
  io.later("trigger_delay_s", begin.trigger_delay_s);
  io.parts("waveforms", begin.waveforms);
  io.attributes("session", begin.session.facts);
  io.parts("notes", begin.session.notes);
  io.later("resumes", begin.resumes);
  io.later("slices_done", begin.slices_done);
}

void describe(auto& io, GridRecord& grid) { io.whole(most_ticks, "first_due_ns", grid.first_due_ns); }

void describe(auto& io, GapRecord& gap) {
  io.whole(most_rows, "first_index", gap.first_index, "count", gap.count);
  io.fields("reason", gap.reason);
}

void describe(auto& io, ClockRecord& clock) {
  io.whole(most_ticks, "host_ns", clock.host_ns, "tick", clock.tick, "half_round_trip_ns",
           clock.half_round_trip_ns);
}

void describe(auto& io, InstrumentClockRecord& clock) {
  io.whole(most_ticks, "host_ns", clock.host_ns, "timer", clock.timer, "half_round_trip_ns",
           clock.half_round_trip_ns);
}

void describe(auto& io, RunStartedRecord& started) { io.whole(most_ticks, "tick", started.tick); }

void describe(auto& io, SegmentRecord& started) {
  io.whole(most_counts, "segment", started.segment);
  io.whole(most_ticks, "tick", started.tick);
}

void describe(auto& io, TriggerRecord& trigger) {
  io.whole(most_counts, "cycle", trigger.cycle);
  io.whole(most_ticks, "tick", trigger.tick);
  io.later("r_wave", trigger.r_wave);
}

void describe(auto& io, SliceRecord& slice) {
  io.fields("block", slice.block);
  io.whole(most_counts, "slice", slice.slice, "cycle", slice.cycle, "cycles", slice.cycles, "dummy_cycles",
           slice.dummy_cycles);
}

void describe(auto& io, RunEndedRecord& ended) {
  io.fields("reason", ended.reason);
  io.later("schedule_done", ended.schedule_done);
  io.whole(most_ticks, "tick", ended.tick);
  io.whole(most_counts, "cycles", ended.cycles, "triggers", ended.triggers);
  io.later("r_waves", ended.r_waves);
}

void describe(auto& io, EventRecord& event) {
  io.fields("level", event.level, "code", event.code, "text", event.text);
  io.if_known("tick", event.tick);
  if (!event.tick) io.whole(most_ticks, "host_ns", event.host_ns);
}

void describe(auto& io, EndRecord& end) { io.if_known("until_ns", end.until_ns); }

/// The alternative of Document that is of this kind, with what the object holds.
template <size_t Kind = 0>
std::optional<Document> read_document(const json& object) {
  if constexpr (Kind < std::variant_size_v<Document>) {
    using Record = std::variant_alternative_t<Kind, Document>;
    if (object.at("record").get_ref<const std::string&>() != Record::kind)
      return read_document<Kind + 1>(object);
    Record record;
    FieldReader reader(object);
    describe(reader, record);
    return record;
  }
  return std::nullopt;
}

static_assert(std::endian::native == std::endian::little, "journals are little-endian");

/// Numbers, and the elements of vectors, one behind the other.
std::vector<uint8_t> bytes_of(const auto&... parts) {
  std::vector<uint8_t> out;
  const auto put = [&]<typename Part>(const Part& part) {
    const void* first = &part;
    size_t size = sizeof part;
    if constexpr (requires { part.data(); }) {
      first = part.data();
      size = part.size() * sizeof(typename Part::value_type);
    }
    const auto* bytes = static_cast<const uint8_t*>(first);
    out.insert(out.end(), bytes, bytes + size);
  };
  (put(parts), ...);
  return out;
}

template <typename Value>
Value take(std::span<const uint8_t>& in) {
  Value value;
  std::memcpy(&value, in.data(), sizeof(Value));
  in = in.subspan(sizeof(Value));
  return value;
}

template <typename Value>
std::vector<Value> take_all(std::span<const uint8_t>& in, size_t count) {
  std::vector<Value> values(count);
  if (count > 0) std::memcpy(values.data(), in.data(), count * sizeof(Value));
  in = in.subspan(count * sizeof(Value));
  return values;
}

constexpr size_t sample_header_bytes = 16;
constexpr size_t position_header_bytes = 20;

}  // namespace

std::string encode(const Document& document) {
  return std::visit(
      [](auto record) {
        json object{{"record", record.kind}};
        FieldWriter writer(object);
        describe(writer, record);
        return json_text(object);
      },
      document);
}

std::vector<uint8_t> encode(const SampleBlock& block) {
  return bytes_of(block.first_index, static_cast<uint32_t>(block.host_ns.size()), block.channels,
                  block.host_ns, block.value_kPa);
}

std::vector<uint8_t> encode(const PositionBlock& block) {
  return bytes_of(block.first_index, static_cast<uint32_t>(block.microsteps.size()), block.first_tick,
                  block.period_ticks, block.microsteps);
}

std::optional<Document> decode_document(std::span<const uint8_t> payload) {
  try {
    const json object = json::parse(payload.begin(), payload.end(), no_deeper_than<json>(), false);
    if (object.is_object()) return read_document(object);
  } catch (const json::exception&) {
    // whole by its CRC but not of this version's form: it shows as missing by what it leaves out
  } catch (const std::out_of_range&) {
  } catch (const JsonTooDeep&) {
  }
  return std::nullopt;
}

std::optional<SampleBlock> decode_samples(std::span<const uint8_t> payload) {
  if (payload.size() < sample_header_bytes) return std::nullopt;
  SampleBlock block;
  block.first_index = take<uint64_t>(payload);
  const size_t samples = take<uint32_t>(payload);
  block.channels = take<uint32_t>(payload);
  if (payload.size() / sizeof(uint64_t) < samples ||
      payload.size() != samples * (1 + size_t{block.channels}) * sizeof(double)) {
    return std::nullopt;
  }
  block.host_ns = take_all<uint64_t>(payload, samples);
  block.value_kPa = take_all<double>(payload, samples * block.channels);
  return block;
}

std::optional<PositionBlock> decode_positions(std::span<const uint8_t> payload) {
  if (payload.size() < position_header_bytes) return std::nullopt;
  PositionBlock block;
  block.first_index = take<uint32_t>(payload);
  const size_t count = take<uint32_t>(payload);
  block.first_tick = take<uint64_t>(payload);
  block.period_ticks = take<uint32_t>(payload);
  if (payload.size() != count * sizeof(int32_t)) return std::nullopt;
  block.microsteps = take_all<int32_t>(payload, count);
  return block;
}

}  // namespace diastole
