// Fuzz target: any bytes are read or rejected without further effect. The first byte selects the reader.

#include "doppel/ros/foxglove/foxglove_protocol.h"
#include "doppel/ros/server/admission.h"
#include "doppel/ros/server/detail/http_responses.h"

namespace {

// The text as each field of a request.
void read_header(std::string_view text) {
  static const doppel::Admission admission("0.0.0.0", false, "0123456789abcdef", 8700);
  static doppel::PageFiles page("/nowhere");
  static_cast<void>(admission.check({.host = text, .target = text, .cookies = text, .origin = text}));
  static_cast<void>(admission.check({.host = "[::1]:1", .target = text, .cookies = text, .origin = {}}));
  static_cast<void>(admission.cookie_for(text));
  static_cast<void>(doppel::is_local_origin(text) || doppel::choose_subprotocol(text).empty());
  static_cast<void>(doppel::http_response_to(
      {.method = "GET", .target = text, .accept_encoding = text, .if_none_match = text}, page, {}));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto bytes = std::as_bytes(std::span(data + 1, size - 1));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  doppel::foxglove::ClientMessage from_client;
  doppel::foxglove::ServerMessage from_server;
  switch (data[0] % 5) {
    case 0:
      static_cast<void>(doppel::foxglove::read_client_text(text, from_client));
      break;
    case 1:
      static_cast<void>(doppel::foxglove::read_client_binary(bytes, from_client));
      break;
    case 2:
      static_cast<void>(doppel::foxglove::read_server_text(text, from_server));
      break;
    case 3:
      static_cast<void>(doppel::foxglove::read_server_binary(bytes, from_server));
      break;
    default:
      read_header(text);
  }
  return 0;
}
