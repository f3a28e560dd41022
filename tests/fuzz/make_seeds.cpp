// Writes the seed corpora: the worked example of every message, as each target reads it, and whole sessions.
//   make_seeds DIRECTORY     (makes a folder for each target in it)

#include <filesystem>
#include <fstream>
#include <string>

#include "protocol/wire/messages.hpp"
#include "tests/estimator/imaging/tagged_ring.hpp"
#include "tests/fuzz/script.hpp"
#include "tests/host/acquisition/session_on_desk.hpp"

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

/// One line of each kind on the daemon's socket.
void write_rpc_lines(const std::filesystem::path& directory) {
  const auto line = [&directory](const char* name, const std::string& text) {
    write(directory / "fuzz_rpc" / name, {text.begin(), text.end()});
  };
  line("request", R"({"jsonrpc":"2.0","id":1,"method":"rig.jog","params":{"mL":5.0,"rate_mL_s":1.0}})");
  line("result", R"({"jsonrpc":"2.0","id":1,"result":{"state":"idle"}})");
  line("input_fault", R"({"jsonrpc":"2.0","id":1,"error":{"code":-32001,"message":"m",)"
                      R"("data":{"file":"f","place":"p","problem":"b","remedy":"r"}}})");
  line("hardware_fault",
       R"({"jsonrpc":"2.0","id":1,"error":{"code":-32002,"message":"rig: is away\n  Find it."}})");
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
  return 0;
}
