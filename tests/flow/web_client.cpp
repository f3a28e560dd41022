#include "tests/flow/web_client.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <array>

namespace diastole::flow {

WebClient::WebClient(int port, bool small_window)
    : port_(port), small_window_(small_window), socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const int bytes = 4096;
  if (small_window) ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVBUF, &bytes, sizeof(bytes));
  const timeval timeout{60, 0};
  ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof(timeout));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(::connect(socket_.get(), reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
}

WebClient::~WebClient() {
  ::shutdown(socket_.get(), SHUT_RDWR);
  if (listener_.joinable()) listener_.join();
}

bool WebClient::send(std::string_view bytes) {
  const std::lock_guard lock(sending_);
  return ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
         static_cast<ssize_t>(bytes.size());
}

std::string WebClient::take(size_t bytes) {
  while (inbox_.size() < bytes) {
    std::array<char, 65536> block{};
    const ssize_t got = ::recv(socket_.get(), block.data(), block.size(), 0);
    if (got <= 0) return {};
    inbox_.append(block.data(), static_cast<size_t>(got));
  }
  std::string received = inbox_.substr(0, bytes);
  inbox_.erase(0, bytes);
  return received;
}

WebAnswer WebClient::read_answer() {
  WebAnswer answer;
  while (!answer.headers.ends_with("\r\n\r\n")) {
    const std::string next = take(1);
    if (next.empty()) return {};
    answer.headers += next;
  }
  answer.status = std::atoi(answer.headers.c_str() + std::string_view("HTTP/1.1 ").size());
  const std::string length = "Content-Length: ";
  if (const size_t found = answer.headers.find(length); found != std::string::npos) {
    answer.body = take(static_cast<size_t>(std::atol(answer.headers.c_str() + found + length.size())));
  }
  return answer;
}

WebAnswer WebClient::get(const std::string& path, const std::vector<std::string>& headers, std::string host) {
  if (host.empty()) host = "127.0.0.1:" + std::to_string(port_);
  std::string request = "GET " + path + " HTTP/1.1\r\nHost: " + host + "\r\n";
  for (const std::string& header : headers)
    request += header + "\r\n";
  EXPECT_TRUE(send(request + "\r\n"));
  return read_answer();
}

WebAnswer WebClient::upgrade(const std::string& token, const std::vector<std::string>& headers) {
  std::vector<std::string> all{
      "Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Version: 13",
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Protocol: diastole, token." + token};
  all.insert(all.end(), headers.begin(), headers.end());
  WebAnswer answer = get("/rpc", all);
  if (answer.status == 101 && !small_window_) listener_ = std::thread([this] { listen(); });
  return answer;
}

bool WebClient::send_frame(int opcode, std::string_view payload, bool last) {
  std::string frame{static_cast<char>((last ? 0x80 : 0) | opcode)};
  const size_t size = payload.size();
  if (size < 126) {
    frame += static_cast<char>(0x80 | size);
  } else {
    const int bytes = size < 65536 ? 2 : 8;
    frame += static_cast<char>(0x80 | (bytes == 2 ? 126 : 127));
    for (int i = bytes - 1; i >= 0; --i)
      frame += static_cast<char>(size >> (8 * i) & 0xFF);
  }
  frame.append(4, '\0');  // a mask that changes nothing
  return send(frame.append(payload));
}

void WebClient::listen() {
  for (bool open = true; open;) {
    std::string message = read_message();
    const std::lock_guard lock(mutex_);
    open = !message.empty();
    closed_ = !open;
    if (open) messages_.push_back(std::move(message));
    heard_.notify_all();
  }
}

std::string WebClient::receive() {
  if (small_window_) return read_message();
  std::unique_lock lock(mutex_);
  heard_.wait(lock, [this] { return closed_ || !messages_.empty(); });
  if (messages_.empty()) return {};
  std::string message = std::move(messages_.front());
  messages_.pop_front();
  return message;
}

std::string WebClient::read_message() {
  for (std::string message;;) {
    const std::string head = take(2);
    if (head.empty()) return {};
    auto size = static_cast<size_t>(head[1] & 0x7F);
    if (size >= 126) {
      size_t longer = 0;
      for (const char byte : take(size == 126 ? 2 : 8))
        longer = longer << 8 | static_cast<unsigned char>(byte);
      size = longer;
    }
    std::string payload = size > 0 ? take(size) : "";
    const int opcode = head[0] & 0x0F;
    if (opcode == 8) return {};
    if (opcode == 9) send_frame(10, payload);
    if (opcode > 1) continue;
    message += payload;
    if ((head[0] & 0x80) != 0) return message;  // the last of its frames
  }
}

nlohmann::json WebClient::call(const std::string& method, const nlohmann::json& params) {
  send_text(nlohmann::json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}}.dump());
  return nlohmann::json::parse(receive(), nullptr, false);
}

}  // namespace diastole::flow
