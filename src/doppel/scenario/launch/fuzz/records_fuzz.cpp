// Fuzz target: a line that the reader of launch files delivers, which the code of a launch file can write.
#include <cstdint>
#include <nlohmann/json.hpp>

#include "doppel/scenario/launch/detail/launch_json.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const nlohmann::json result = doppel::bounded_json({reinterpret_cast<const char*>(data), size});
    if (!result.is_object()) return 0;
    for (const doppel::LaunchRecord& record : doppel::launch_from_json(result).records) {
      static_cast<void>(record.parameter("robot_description"));
      static_cast<void>(doppel::bare_namespace(record.name_space));
    }
  } catch (const doppel::InputError&) {
  } catch (const nlohmann::json::exception&) {
    // A value is missing, or has another type than a record's.
  }
  return 0;
}
