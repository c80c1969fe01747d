#include "doppel/ros/server/admission.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <system_error>

#include "doppel/base/core/text.h"
#include "doppel/ros/server/detail/header_text.h"

namespace doppel {
namespace {

std::string machine_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? lowered(name.data()) : "";
}

bool is_address(std::string_view text, int family) {
  std::array<unsigned char, sizeof(in6_addr)> address{};
  return inet_pton(family, std::string(text).c_str(), address.data()) == 1;
}

// Comparison in constant time, so that the duration does not reveal how much of a token is right.
bool same_secret(std::string_view given, std::string_view secret) {
  volatile unsigned difference = given.size() == secret.size() ? 0 : 1;
  for (std::size_t i = 0; i < secret.size(); ++i) {
    const auto theirs = static_cast<unsigned char>(i < given.size() ? given[i] : 0);
    difference = difference | static_cast<unsigned>(theirs ^ static_cast<unsigned char>(secret[i]));
  }
  return difference == 0;
}

// The value of "name=value" among entries; "": none.
std::string_view value_of(std::string_view entries, char separator, std::string_view name) {
  std::string_view value;
  any_entry(entries, separator, [&](std::string_view entry) {
    const std::size_t equals = entry.find('=');
    if (equals == std::string_view::npos || entry.substr(0, equals) != name) return false;
    value = entry.substr(equals + 1);
    return true;
  });
  return value;
}

std::string_view token_in_address(std::string_view target) {
  const std::size_t question = target.find('?');
  return question == std::string_view::npos ? "" : value_of(target.substr(question + 1), '&', "token");
}

}  // namespace

Admission::Admission(std::string bound, bool loopback, std::string token, std::uint16_t port)
    : bound_(lowered(bound)),
      machine_(machine_name()),
      token_(std::move(token)),
      cookie_name_(fmt::format("doppel_{}", port)),  // browsers share cookies between all ports of a host
      loopback_(loopback) {}

Status Admission::check(const Credentials& who) const {
  if (!is_own_name(who.host)) {
    return Status::refused(
        loopback_ ? "this server accepts only local clients; use the host name localhost"
                  : "the request's Host is neither the address of this server nor the name of this machine");
  }
  if (who.origin && !is_own_origin(*who.origin, who.host))
    return Status::refused("pages of another origin may not connect to the twin");
  if (token_.empty() || same_secret(token_in_address(who.target), token_) ||
      same_secret(value_of(who.cookies, ';', cookie_name_), token_)) {
    return {};
  }
  return Status::refused(
      "the token is missing or wrong; open the URL that was printed at the start, with ?token=...");
}

std::string Admission::cookie_for(std::string_view target) const {
  if (token_.empty() || !same_secret(token_in_address(target), token_)) return "";
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict", cookie_name_, token_);
}

bool Admission::is_own_name(std::string_view host) const {
  if (loopback_) return is_local_host(host);
  const std::string_view name = name_in_host(host);
  if (name.empty()) return false;
  const std::string asked = lowered(name);
  return is_address(name, AF_INET) || is_address(name, AF_INET6) || asked == "localhost" || asked == bound_ ||
         (!machine_.empty() && (asked == machine_ || asked == machine_ + ".local"));
}

bool Admission::is_own_origin(std::string_view origin, std::string_view host) const {
  if (loopback_ && token_.empty()) return is_local_origin(origin);
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme))
      return lowered(origin.substr(scheme.size())) == lowered(trim_blanks(host));
  }
  return false;
}

std::string make_token() {
  std::array<unsigned char, 16> bits{};
  if (getrandom(bits.data(), bits.size(), 0) != static_cast<ssize_t>(bits.size()))
    throw std::system_error(errno, std::generic_category(), "the system provides no random numbers");
  std::string out;
  for (const unsigned char byte : bits) out += fmt::format("{:02x}", byte);
  return out;
}

Status check_token(std::string_view token) {
  if (token.size() < kMinTokenLength) {
    return Status::refused(
        fmt::format("it has {} characters; at least {} are required", token.size(), kMinTokenLength));
  }
  const auto plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.' || c == '~';
  };
  if (!std::ranges::all_of(token, plain))
    return Status::refused("it is part of a URL: only letters, digits and - _ . ~ are allowed");
  return {};
}

std::string_view name_in_host(std::string_view host) {
  host = trim_blanks(host);
  std::string_view name = host, port;
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    if (end == std::string_view::npos) return "";
    name = host.substr(1, end - 1);
    port = host.substr(end + 1);
    if (!is_address(name, AF_INET6)) return "";
  } else if (const std::size_t colon = host.find(':'); colon != std::string_view::npos) {
    name = host.substr(0, colon);
    port = host.substr(colon);
  }
  const auto digit = [](unsigned char c) { return std::isdigit(c) != 0; };
  if (!port.empty() && (port.front() != ':' || !std::ranges::all_of(port.substr(1), digit))) return "";
  return name;
}

bool is_local_host(std::string_view host) {
  const std::string name = lowered(name_in_host(host));
  return name == "localhost" || name == "::1" || (name.starts_with("127.") && is_address(name, AF_INET));
}

bool is_local_origin(std::string_view origin) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme)) return is_local_host(origin.substr(scheme.size()));
  }
  return false;
}

}  // namespace doppel
