#include "tools/benchmarks/consoles_on_bench.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::asio::ip::tcp;
using nlohmann::json;
using namespace std::chrono_literals;

class Console {
 public:
  explicit Console(const std::string& url) {
    const size_t colon = url.rfind(':'), slash = url.find('/', colon);
    const std::string port = url.substr(colon + 1, slash - colon - 1);
    const std::string token = url.substr(url.find("token=") + 6);
    stream_.next_layer().connect(
        {boost::asio::ip::address_v4::loopback(), static_cast<uint16_t>(std::stoi(port))});
    stream_.set_option(websocket::stream_base::decorator([token](websocket::request_type& request) {
      request.set(beast::http::field::sec_websocket_protocol, "diastole, token." + token);
    }));
    stream_.handshake("127.0.0.1:" + port, "/rpc");
  }

  /// As the page does in a run: pressure and progress ten times a second, the state five times.
  void look(int turn) {
    const json trace = ask("run.trace", wanted_);
    wanted_ = {{"run_id", trace.at("run_id")},
               {"first_row", trace.at("first_row").get<size_t>() + trace.at("time_s").size()},
               {"first_trigger", trace.at("first_trigger").get<size_t>() + trace.at("trigger_s").size()}};
    (void)ask("run.progress", {{"first_remark", 0}});
    if (turn % 2 == 0) (void)ask("rig.status", json::object());
  }

 private:
  json ask(const char* method, const json& params) {
    const std::string request =
        json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}}.dump();
    stream_.write(boost::asio::buffer(request));
    beast::flat_buffer answer;
    stream_.read(answer);
    return json::parse(beast::buffers_to_string(answer.data())).at("result");
  }

  boost::asio::io_context context_;
  websocket::stream<tcp::socket> stream_{context_};
  json wanted_ = json::object();
};

}  // namespace

ConsolesOnBench::ConsolesOnBench(const std::string& url, int count) {
  for (int i = 0; i < count; ++i) {
    std::shared_ptr<Console> console;
    try {
      console = std::make_shared<Console>(url);
    } catch (const boost::system::system_error& error) {
      throw HardwareError("console", error.what(), "See the daemon's log.");
    }
    threads_.emplace_back([console](const std::stop_token& stop) {
      for (int turn = 0; !stop.stop_requested(); ++turn) {
        console->look(turn);
        std::this_thread::sleep_for(100ms);
      }
    });
  }
}

}  // namespace diastole
