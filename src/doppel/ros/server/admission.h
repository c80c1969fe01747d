#pragma once
// Decides which clients the server accepts, by the Host, Origin and token of a request.
// Independent of sockets.
//
// On loopback only programs and pages of this machine are accepted: a page from elsewhere is rejected by its
// Origin, and one under a name that resolves to this machine (DNS rebinding) by its Host. On any other
// address every client needs the token, the Origin has to be that of the served page, and Host has to be an
// address or a name of this machine.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "doppel/base/core/status.h"
#include "doppel/export.h"

namespace doppel {

struct Credentials {
  std::string_view host, target, cookies;
  std::optional<std::string_view> origin;  // sent by browsers, optional for other programs
};

class DOPPEL_API Admission {
 public:
  // bound: the address or name that the server listens on. token: "" for none, else make_token()'s or one
  // that check_token() has passed.
  Admission(std::string bound, bool loopback, std::string token, std::uint16_t port);

  // Refuses with the reason for the client.
  [[nodiscard]] Status check(const Credentials& who) const;
  // The cookie for a client with the token in the address, so that the page's further requests do not need
  // the token there; "": none.
  [[nodiscard]] std::string cookie_for(std::string_view target) const;

 private:
  [[nodiscard]] bool is_own_name(std::string_view host) const;
  [[nodiscard]] bool is_own_origin(std::string_view origin, std::string_view host) const;

  std::string bound_, machine_, token_, cookie_name_;
  bool loopback_;
};

// 128 bits of the system's randomness, in hexadecimal.
DOPPEL_API std::string make_token();
// Refuses a token that is too short, or has characters that must be escaped in an address or a cookie.
DOPPEL_API Status check_token(std::string_view token);
constexpr std::size_t kMinTokenLength = 16;

// True if a Host header is one of this machine: "localhost:8700", "127.0.0.1", "[::1]:8700".
DOPPEL_API bool is_local_host(std::string_view host);
// True if an Origin header is that of a page from this machine.
DOPPEL_API bool is_local_origin(std::string_view origin);
// The name or address in a Host header, without port and brackets; "": malformed.
DOPPEL_API std::string_view name_in_host(std::string_view host);

}  // namespace doppel
