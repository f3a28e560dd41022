#include "tools/diastole/desk/desk_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <csignal>

#include "estimator/report/cine.hpp"
#include "host/web/access_policy.hpp"
#include "host/web/console_stream.hpp"
#include "host/web/listen.hpp"
#include "host/web/request.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/diastole/desk/embedded.hpp"

namespace diastole::desk {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using beast::error_code;

constexpr std::chrono::seconds request_timeout{10};
constexpr uint64_t most_body_bytes = 1 << 20;  // a choice of some ten thousand points
constexpr size_t most_connections = 32;

using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

std::string_view view(beast::string_view field) { return {field.data(), field.size()}; }

struct Answer {
  int status = 200;
  std::string_view type = "application/json";
  std::shared_ptr<const std::string> body = {};
};

Answer as_text(const DeskAnswer& answer) { return {answer.status, "text/plain; charset=utf-8", answer.body}; }

/// What every desk's page has beside its own.
std::span<const report::PageAsset> shared_assets() {
  static const std::array assets{
      report::PageAsset{"/common.js", "text/javascript", embedded::common_js},
      report::PageAsset{"/desk.css", "text/css", embedded::desk_css},
      report::PageAsset{"/icon.svg", "image/svg+xml", web::find_page_file("/icon.svg")->text}};
  return assets;
}

/// What becomes of requests.
class Desk {
 public:
  Desk(DeskPages& pages, web::AccessPolicy policy) : pages_(pages), policy_(std::move(policy)) {}

  [[nodiscard]] const web::AccessPolicy& policy() const { return policy_; }

  Answer answer(const Request& request) {
    const auto origin = request.find(http::field::origin);
    if (const auto refusal = policy_.check_place(
            view(request[http::field::host]),
            origin == request.end() ? std::nullopt : std::optional(view(origin->value()))))
      return as_text(refused(refusal->status, refusal->sentence));
    const std::string_view all = view(request.target());
    const std::string_view path = all.substr(0, all.find('?'));
    const bool is_get = request.method() == http::verb::get;
    if (const report::PageAsset* asset = is_get ? find_asset(path) : nullptr)
      return {200, asset->type, std::make_shared<const std::string>(asset->text)};
    if (policy_.role_of(web::token_in(view(request[http::field::authorization]), {})) != ConsoleRole::control)
      return as_text(refused(
          401, "The token in this address is not valid: open the address that `diastole desk` printed."));
    std::optional<DeskAnswer> answer;
    try {
      if (is_get) answer = pages_.get(path);
      if (request.method() == http::verb::post) answer = pages_.post(path, request.body());
    } catch (const InputError& error) {
      return as_text(refused(422, error.what()));
    } catch (const std::exception& error) {
      return as_text(refused(500, fmt::format("The desk could not do that: {}", error.what())));
    }
    if (!answer) return as_text(refused(404, "There is no such thing here. The desk is at /."));
    if (answer->status != 200) return as_text(*answer);
    return {200, "application/json", answer->body};
  }

 private:
  [[nodiscard]] const report::PageAsset* find_asset(std::string_view path) const {
    for (const std::span<const report::PageAsset> assets :
         {pages_.assets(), shared_assets(), report::cine_assets()}) {
      const auto found = std::ranges::find(assets, path, &report::PageAsset::path);
      if (found != assets.end()) return &*found;
    }
    return nullptr;
  }

  DeskPages& pages_;
  web::AccessPolicy policy_;
};

class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Desk& desk, size_t& count, tcp::socket socket)
      : desk_(desk), count_(count), stream_(std::move(socket), nullptr) {
    ++count_;
  }
  ~Connection() { --count_; }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void read() {
    parser_.emplace();
    parser_->header_limit(web::most_header_bytes);
    parser_->body_limit(most_body_bytes);
    stream_.tcp().expires_after(request_timeout);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](error_code error, size_t) {
      if (!error) self->reply(self->desk_.answer(self->parser_->get()));
    });
  }

 private:
  void reply(const Answer& answer) {
    response_ = Response(static_cast<http::status>(answer.status), 11);
    response_.set(http::field::content_type, {answer.type.data(), answer.type.size()});
    web::set_page_headers(response_);
    response_.keep_alive(parser_->get().keep_alive());
    response_.body() = *answer.body;
    response_.prepare_payload();
    // A slow line, such as a tunnel to another town, passes a hundred kilobytes in a second.
    constexpr size_t least_bytes_per_s = 100'000;
    stream_.tcp().expires_after(request_timeout +
                                std::chrono::seconds(response_.body().size() / least_bytes_per_s));
    http::async_write(stream_, response_, [self = shared_from_this()](error_code error, size_t) {
      if (!error && self->response_.keep_alive()) self->read();
    });
  }

  Desk& desk_;
  size_t& count_;
  web::ConsoleStream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  Response response_;
};

}  // namespace

struct DeskServer::Impl {
  Impl(DeskPages& pages, uint16_t port)
      : desk(pages, web::AccessPolicy({asio::ip::address_v4::loopback(), port}, "")), acceptor(context) {
    web::listen_at(acceptor, {asio::ip::address_v4::loopback(), port}, "desk", "--port");
  }

  void accept() {
    acceptor.async_accept([this](error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error && connections < most_connections)
        std::make_shared<Connection>(desk, connections, std::move(socket))->read();
      accept();
    });
  }

  Desk desk;
  size_t connections = 0;  // outlives the context's, which count it down
  asio::io_context context{1};
  tcp::acceptor acceptor;
};

DeskServer::DeskServer(DeskPages& pages, uint16_t port) : impl_(std::make_unique<Impl>(pages, port)) {}
DeskServer::~DeskServer() = default;

std::string DeskServer::url() const {
  return impl_->desk.policy().url(ConsoleRole::control, impl_->acceptor.local_endpoint().port());
}

void DeskServer::run() {
  asio::signal_set signals(impl_->context, SIGINT, SIGTERM);
  signals.async_wait([this](error_code, int) { impl_->context.stop(); });
  impl_->accept();
  impl_->context.run();
}

}  // namespace diastole::desk
