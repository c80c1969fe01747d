#pragma once
// The usual response of a service: success, and a message or the reason of failure.

#include <string>

#include "doppel/base/core/status.h"

namespace doppel {

template <class Response>
Response answer(const Status& status, std::string good) {
  Response response;
  response.success = status.ok();
  if constexpr (requires { response.status_message; }) {
    response.status_message = status.ok() ? std::move(good) : status.why();
  } else {
    response.message = status.ok() ? std::move(good) : status.why();
  }
  return response;
}

}  // namespace doppel
