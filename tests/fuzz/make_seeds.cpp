// Writes the seed corpora: the worked example of every message, as each target reads it, and whole sessions.
//   make_seeds DIRECTORY     (makes a folder for each target in it)

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "estimator/explain/rig/reference_json.hpp"
#include "estimator/io/fibre_points.hpp"
#include "estimator/io/fit_file.hpp"
#include "estimator/io/flow_file.hpp"
#include "estimator/io/tracking_file.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/signing/signing_key.hpp"
#include "protocol/wire/messages.hpp"
#include "tests/estimator/imaging/tagged_ring.hpp"
#include "tests/fuzz/file_kinds.hpp"
#include "tests/fuzz/script.hpp"
#include "tests/host/acquisition/session_on_desk.hpp"
#include "tests/host/flash/update_files.hpp"
#include "tests/host/rpc/usual_requests.hpp"

namespace {

using namespace diastole;
using Bytes = std::vector<std::uint8_t>;

template <class Message>
Bytes encoded(const Message& message) {
  std::array<std::uint8_t, wire::kMaxPayloadBytes> memory{};
  const auto bytes = wire::encode(message, memory);
  return {bytes.begin(), bytes.end()};
}

template <class Message>
void add(fuzz::ScriptWriter& script, const Message& message) {
  script.message(Message::kType, encoded(message));
}

void write(const std::filesystem::path& file, const Bytes& bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

template <class Message>
void write_example(const std::filesystem::path& directory, const std::string& name) {
  Bytes typed = encoded(Message::example());
  typed.insert(typed.begin(), static_cast<std::uint8_t>(Message::kType));
  write(directory / "fuzz_wire" / name, typed);
  fuzz::ScriptWriter script;
  add(script, Message::example());
  const bool from_host = wire::sender_of(Message::kType) == wire::Sender::host;
  write(directory / (from_host ? "fuzz_controller" : "fuzz_client") / name, script.bytes());
}

/// Homed, loaded, started, and ended in each way.
void write_sessions(const std::filesystem::path& directory) {
  constexpr std::uint32_t lease = 0x5EA5E;  // Bench::kLease
  fuzz::ScriptWriter session;
  wire::Configure configure = wire::Configure::example();
  configure.homing_flow_uL_per_s = 50'000;
  add(session, configure);
  add(session, wire::Home{1, lease});
  session.time(150);
  wire::AddSegment segment = wire::AddSegment::example();
  segment.stroke_nL = 2'000'000;
  segment.period_us = 300'000;
  add(session, segment);
  wire::Arm arm = wire::Arm::example();
  arm.rest_us = 1'000;
  add(session, arm);
  session.time(10);
  add(session, wire::Start{2, lease});
  session.time(60);
  const std::filesystem::path home = directory / "fuzz_controller";
  write(home / "session", session.bytes());
  const auto ended = [&](const char* name, auto end) {
    fuzz::ScriptWriter whole = session;
    end(whole);
    whole.time(100);
    add(whole, wire::ClearFault{9});
    write(home / name, whole.bytes());
  };
  ended("session_stop_now", [](fuzz::ScriptWriter& script) { add(script, wire::StopNow{3}); });
  ended("session_stop_at_cycle_end",
        [](fuzz::ScriptWriter& script) { add(script, wire::StopAtCycleEnd{3}); });
  ended("session_halt", [](fuzz::ScriptWriter& script) { add(script, wire::Halt{3}); });
  ended("session_estop", [](fuzz::ScriptWriter& script) { script.other(1).time(1).other(0); });
  ended("session_limit", [](fuzz::ScriptWriter& script) { script.other(2).time(1).other(0); });
  ended("session_silence", [](fuzz::ScriptWriter& script) { script.other(4).time(150).other(0); });
  fuzz::ScriptWriter client;
  client.other(1).other(2).other(3);
  add(client, wire::RunStarted::example());
  add(client, wire::PositionBatch::example());
  add(client, wire::Trigger::example());
  client.time(10).other(4);
  add(client, wire::RunEnded::example());
  client.other(7).other(5);
  write(directory / "fuzz_client" / "session", client.bytes());
}

/// One line of each kind on the daemon's socket, and what its clients ask.
void write_rpc_lines(const std::filesystem::path& directory) {
  using nlohmann::json;
  const auto line = [&directory](const std::string& name, const std::string& text) {
    write(directory / "fuzz_rpc" / name, {text.begin(), text.end()});
  };
  line("result", R"({"jsonrpc":"2.0","id":1,"result":{"state":"idle"}})");
  line("input_fault", R"({"jsonrpc":"2.0","id":1,"error":{"code":-32001,"message":"m",)"
                      R"("data":{"file":"f","place":"p","problem":"b","remedy":"r"}}})");
  line("hardware_fault",
       R"({"jsonrpc":"2.0","id":1,"error":{"code":-32002,"message":"rig: is away\n  Find it."}})");
  const auto request = [](const std::string& method, const json& params = json::object()) {
    return json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}}.dump() + "\n";
  };
  for (const auto& [method, params] : usual_requests())
    line(method, request(method, params));
  line("control", request("rig.home") + "\1" + request("console.sign_in", {{"name", "Ann"}}) + "\1" +
                      request("control.take") + "\1" + request("control.take", {{"take_over", "operator"}}) +
                      "\2" + request("rig.home") + request("console.address") + "\1" +
                      request("control.release"));
}

/// Requests as fuzz_console reads them, and a message behind the one that is let in.
void write_http_requests(const std::filesystem::path& directory) {
  const std::string host = "Host: 127.0.0.1:8600\r\n";
  const std::string upgrade =
      "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
  const auto request = [&directory](const char* name, const std::string& text) {
    write(directory / "fuzz_console" / name, {text.begin(), text.end()});
  };
  request("page", "GET / HTTP/1.1\r\n" + host + "\r\n");
  request("script", "GET /console.js?x HTTP/1.1\r\nHost: LOCALHOST\r\n\r\n");
  request("role", "GET /role HTTP/1.1\r\nHost: [::1]:8600\r\nAuthorization: Bearer \x01\r\n\r\n");
  request("watch", "GET /role HTTP/1.1\r\n" + host + "Authorization: Bearer \x02\r\n\r\n");
  request("wrong_token", "GET /role HTTP/1.1\r\n" + host + "Authorization: Bearer 0\r\n\r\n");
  request("rebound", "GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n");
  request("post", "POST / HTTP/1.1\r\n" + host + "Content-Length: 2\r\n\r\n{}");
  request("console", "GET /rpc HTTP/1.1\r\n" + host + "Origin: http://127.0.0.1:8600\r\n" + upgrade +
                         "Sec-WebSocket-Protocol: diastole, token.\x01\r\n\r\n" +
                         R"({"jsonrpc":"2.0","id":1,"method":"run.stop","params":{"how":"now"}})");
  request("other_site", "GET /rpc HTTP/1.1\r\n" + host + "Origin: http://evil.example\r\n" + upgrade +
                            "Sec-WebSocket-Protocol: diastole, token.\x01\r\n\r\n");
}

void add(Bytes& records, RecordKind kind, std::span<const std::uint8_t> payload) {
  records.push_back(static_cast<std::uint8_t>(kind));
  records.push_back(static_cast<std::uint8_t>(payload.size()));
  records.push_back(static_cast<std::uint8_t>(payload.size() >> 8U));
  records.insert(records.end(), payload.begin(), payload.end());
}

/// The journal of a session on the desk: as it is, its records as fuzz_journal reads them, and each kind by itself.
void write_journals(const std::filesystem::path& directory) {
  const std::filesystem::path home = directory / "fuzz_journal";
  SessionOnDesk session(short_session);
  session.run();
  std::ifstream stream(session.journal, std::ios::binary);
  Bytes whole{0};
  whole.insert(whole.end(), std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  write(home / "whole", whole);
  Bytes records;
  const auto write_one = [&](const std::string& name, RecordKind kind,
                             std::span<const std::uint8_t> payload) {
    Bytes alone;
    add(alone, kind, payload);
    write(home / name, alone);
  };
  for (const JournalRecord& record : read_journal(session.journal).records) {
    add(records, record.kind, record.payload);
    const std::string name = record.kind == RecordKind::document
                                 ? nlohmann::json::parse(record.payload).at("record").get<std::string>()
                                 : std::to_string(static_cast<unsigned>(record.kind));
    write_one(name, record.kind, record.payload);
  }
  write(home / "records", records);
  for (const std::string text :
       {R"({"record":"gap","first_index":3,"count":2,"reason":"no answer"})",
        R"({"record":"slice","block":"tagged","slice":0,"cycle":0,"cycles":2,"dummy_cycles":0})"}) {
    write_one(nlohmann::json::parse(text).at("record"), RecordKind::document,
              {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  }
}

/// The sound file, and each object once in another way.
void write_runfile_scripts(const std::filesystem::path& directory) {
  constexpr std::size_t most_objects = 64;
  write(directory / "fuzz_runfile" / "sound", {});
  for (std::size_t object = 0; object < most_objects; ++object) {
    Bytes script(object + 1, 0);
    script.back() = static_cast<std::uint8_t>(1 + object % 7);
    write(directory / "fuzz_runfile" / std::to_string(object), script);
  }
}

void write_images(const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory / "fuzz_dicom");
  test::write_ring({.phases = 1, .pixels = 12, .pixel_mm = 8}, directory / "fuzz_dicom", "classic");
}

/// As fuzz_files reads it: what it is, then the file. Of a long one its beginning.
void write_file(const std::filesystem::path& directory, fuzz::FileKind kind, std::string_view text) {
  constexpr size_t most_bytes = 3000;
  Bytes bytes{static_cast<std::uint8_t>(kind)};
  bytes.insert(bytes.end(), text.begin(),
               text.begin() + static_cast<std::ptrdiff_t>(std::min(text.size(), most_bytes)));
  static int number = 0;
  write(directory / "fuzz_files" / std::to_string(++number), bytes);
}

/// An image of 2 x 2 x 2 voxels in three volumes (nifti1.h), and its tables.
std::string nifti_seed() {
  std::string header(352, '\0');
  const auto put = [&](size_t at, auto value) { std::memcpy(header.data() + at, &value, sizeof(value)); };
  put(0, std::int32_t{348});
  size_t at = 40;
  for (const std::int16_t size : std::array<std::int16_t, 8>{4, 2, 2, 2, 3, 1, 1, 1}) {
    put(at, size);
    at += sizeof(size);
  }
  put(70, std::int16_t{16});  // floats
  put(72, std::int16_t{32});
  for (at = 76; at < 108; at += 4)
    put(at, 2.0F);
  put(108, 352.0F);
  put(112, 1.0F);
  put(254, std::int16_t{1});  // of the three rows that follow
  for (size_t row = 0; row < 3; ++row)
    put(280 + 20 * row, 2.0F);
  header.replace(344, 3, "n+1");
  return header + std::string(4 * 2 * 2 * 2 * 3, 'A') + "\f0 1000 1000\n\f0 1 0\n0 0 1\n0 0 0\n";
}

std::string reference_seed() {
  explain::Reference reference;
  reference.tolerances = {"hose_length", "hose_bore"};
  reference.mean = Eigen::Vector2d(0.5, -1.0);
  reference.covariance = Eigen::Matrix2d{{0.25, 0.1}, {0.1, 0.5}};
  reference.segments["hold"] = {Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(1, 1, 1)};
  reference.rms = {0.012, 0.5, 0.02};
  reference.hose_length_m = 4.7;
  reference.sessions = 1;
  return to_json(reference);
}

/// The examples, documents of records with one of everything, and grids of one cell.
void write_files(const std::filesystem::path& directory) {
  using enum fuzz::FileKind;
  const std::vector<std::pair<fuzz::FileKind, const char*>> examples{
      {rig, "rig.toml"},
      {rig, "paper-gap/rig.toml"},
      {experiment, "gel.experiment.toml"},
      {experiment, "heart.experiment.toml"},
      {experiment, "study.experiment.toml"},
      {waveform, "heart.csv"},
      {waveform, "shape/ventricle.csv"},
      {study, "phantom-a.study.toml"},
      {study, "lv-clean.study.toml"},
      {study, "imaged-ventricle.study.toml"},
      {study, "tagged-gel/tagged-gel.study.toml"},
      {study, "paper-gap/paper-gap.study.toml"},
      {frame_table, "phantom-a.frames.csv"},
      {tag_table, "phantom-a.tags.csv"},
      {point_table, "phantom-a.points.csv"},
      {effect, "effects/my-seal.effect.toml"},
      {effect, "effects/viscoelasticity.effect.toml"},
      {law, "laws/guccione.law.toml"},
      {law, "laws/holzapfel-ogden.law.toml"},
      {guide, "ventricle.guide.csv"},
      {bench_test, "shear-test.csv"},
  };
  for (const auto& [kind, name] : examples)
    write_file(directory, kind,
               read_whole_file(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples" / name));
  write_file(directory, fibre_table, std::string(fibre_points_mark) + "\n1,2,3,1,0,0,5\n");
  write_file(directory, fit, to_json(FitRecord{}));
  TrackingRecord tracked;
  tracked.slices.emplace_back().images.emplace_back();
  write_file(directory, tracking, to_json(tracked));
  FlowRecord flowed;
  flowed.images.emplace_back();
  flowed.loop.emplace_back();
  write_file(directory, flow, to_json(flowed));
  write_file(directory, gmsh,
             "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 0 0\n$EndEntities\n"
             "$Nodes\n1 4 10 40\n3 1 0 4\n10\n20\n30\n40\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n"
             "$Elements\n1 1 2 2\n3 1 4 1\n2 10 20 30 40\n$EndElements\n"
             "$NodeData\n1\n\"u\"\n1\n0.5\n3\n0\n3\n1\n10 0 0 0\n$EndNodeData\n");
  write_file(directory, vtu, R"(<VTKFile type="UnstructuredGrid" version="1.0"><UnstructuredGrid>
<Piece NumberOfPoints="4" NumberOfCells="1">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">4</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">10</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>)");
  write_file(directory, xdmf, R"(<Xdmf Version="3.0"><Domain><Grid>
<Topology TopologyType="Tetrahedron" NumberOfElements="1">
<DataItem Dimensions="1 4" Format="XML" NumberType="Int">0 1 2 3</DataItem></Topology>
<Geometry GeometryType="XYZ"><DataItem Dimensions="4 3" Format="XML">0 0 0 1 0 0 0 1 0 0 0 1</DataItem></Geometry>
</Grid></Domain></Xdmf>)");
  write_file(directory, mesh, R"(format = "diastole-mesh"
version = 1
[[node]]
x_mm = [0, 1, 0, 0, 0, 0, 0, 0]
y_mm = [0, 0, 1, 0, 0, 0, 0, 0]
z_mm = [0, 0, 0, 0, 1, 0, 0, 0]
fibre_deg = 60.0
shares = ["value 1"]
zero = ["d1"]
[[element]]
nodes = [1, 1, 1, 1, 1, 1, 1, 1]
faces = ["inner xi3=0", "outer xi3=1"]
)");
  write_file(directory, exfiles,
             R"(Group name: a
 #Fields=1
 1) coordinates, coordinate, rectangular cartesian, #Components=3
 x. Value index=1, #Derivatives=7(d/ds1,d/ds2,d2/ds1ds2,d/ds3,d2/ds1ds3,d2/ds2ds3,d3/ds1ds2ds3)
Node: 1
 0 1 0 0 0 0 0 0
)"
             "\f"
             R"(Group name: a
Shape. Dimension=3
#Scale factor sets=0
#Nodes=8
Element: 1 0 0
 Nodes:
 1 1 1 1 1 1 1 1
)");
  write_file(directory, guide, "x y z contour-type sliceID weight frame\n1 2 3 SAX_LV_ENDOCARDIAL 3 1 0\n");
  write_file(directory, nifti, nifti_seed());
  write_file(
      directory, edits,
      R"({"slice": "series 2, slice 2", "direction": 1, "phase": 1, "action": "line", "tag": 2, "points": [[9, 2], [9, 8]]}
{"slice": "series 2, slice 1", "phase": "all", "action": "mask", "points": [[1, 1], [4, 1], [4, 5]]}
{"slice": "series 2, slice 1", "phase": 2, "action": "contour", "contour": "inner", "points": [[3, 3], [9, 3], [9, 8]]}
{"slice": "series 2, slice 1", "action": "height", "height_mm": 5}
{"action": "undo", "line": 2}
)");
  write_file(directory, pose,
             "kind = \"annulus\"\norigin_mm = [1, 2, 3]\nx_axis = [1, 0, 0]\ny_axis = [0, 1, 0]\n"
             "z_axis = [0, 0, 1]\n");
  write_file(directory, reference, reference_seed());
  const Bytes image = flash_test::make_update_file({});
  write_file(directory, update, {reinterpret_cast<const char*>(image.data()), image.size()});
  const std::filesystem::path key_file = directory / "seed-key.pem";
  std::filesystem::remove(key_file);
  (void)signing::make_key_file(key_file);
  write_file(directory, key, read_whole_file(key_file));
  std::filesystem::remove(key_file);
  write_file(directory, elf,
             std::string("\x7f"
                         "ELF\1\1\1\0\0\0\0\0\0\0\0\0\2\0\x28\0\1\0\0\0",
                         24));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::filesystem::path directory = argv[1];
#define DIASTOLE_MESSAGE(number, name, sender, delivery) write_example<wire::name>(directory, #name);
#include "protocol/wire/message_list.inc"
  write_sessions(directory);
  write_rpc_lines(directory);
  write_http_requests(directory);
  write_journals(directory);
  write_runfile_scripts(directory);
  write_images(directory);
  write_files(directory);
  return 0;
}
