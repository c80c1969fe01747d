#pragma once
// Which clients the server accepts: what a request's Host, Origin and token have to be. Knows nothing of
// sockets.
//
// On loopback only this machine may ask, and no page from elsewhere: neither by its Origin nor under a name
// that was made to point here (DNS rebinding), which shows in Host. On any other address everybody who asks
// needs the token, the Origin has to be the page's own, and Host has to be an address or a name of this
// machine.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "doppel/core/status.h"
#include "doppel/export.h"

namespace doppel {

struct Credentials {
  std::string_view host, target, cookies;
  std::optional<std::string_view> origin;  // browsers send one, other programs need not
};

class DOPPEL_API Admission {
 public:
  // bound: the address or name that the server listens on. token: "" for none, else make_token()'s or one
  // that check_token() has passed.
  Admission(std::string bound, bool loopback, std::string token, std::uint16_t port);

  // Refused with what to tell the one who asks.
  [[nodiscard]] Status check(const Credentials& who) const;
  // What to set for one who came with the token in the address, so that what the page loads needs it no more;
  // "": nothing.
  [[nodiscard]] std::string cookie_for(std::string_view target) const;

 private:
  [[nodiscard]] bool is_own_name(std::string_view host) const;
  [[nodiscard]] bool is_own_origin(std::string_view origin, std::string_view host) const;

  std::string bound_, machine_, token_, cookie_name_;
  bool loopback_;
};

// 128 bits of the system's randomness, in hexadecimal.
DOPPEL_API std::string make_token();
// Refused: too short, or with characters that an address or a cookie would have to escape.
DOPPEL_API Status check_token(std::string_view token);
constexpr std::size_t kMinTokenLength = 16;

// "localhost:8700", "127.0.0.1", "[::1]:8700": the Host header of a request that was meant for this machine.
DOPPEL_API bool is_local_host(std::string_view host);
// The Origin header of a page from this machine.
DOPPEL_API bool is_local_origin(std::string_view origin);
// The name or address in a Host header, without port and brackets; "": malformed.
DOPPEL_API std::string_view name_in_host(std::string_view host);

}  // namespace doppel
