#pragma once
// The present ranges of a twin's range sensors, from the thread that measures them to controllers in the loop, which does not
// wait for it: a range is that of the last sample that is finished. With RigOptions::lockstep that is the last one due.

#include <atomic>
#include <limits>
#include <map>
#include <memory>
#include <string>

#include "doppel/export.h"
#include "doppel/sensors/rigs/rig_sensor.h"

namespace doppel {

class DOPPEL_API RangeValues {
 public:
  struct Value {
    std::atomic<double> range = std::numeric_limits<double>::quiet_NaN();  // m; REP 117; NaN: no sample yet
    std::atomic<int> readers = 0;                                          // for whom it is measured
  };

  // -- between steps
  // Of the sensor with this name on this instance; made when it is first asked for.
  std::shared_ptr<Value> of(const RigSensor& sensor);

 private:
  std::map<std::string, std::shared_ptr<Value>> values_;  // by sensor_key()
};

// One reader of a range, during its lifetime.
class DOPPEL_API RangeReader {
 public:
  explicit RangeReader(std::shared_ptr<RangeValues::Value> value) : value_(std::move(value)) {
    ++value_->readers;
  }
  ~RangeReader() { --value_->readers; }
  RangeReader(const RangeReader&) = delete;
  RangeReader& operator=(const RangeReader&) = delete;

  // In the loop.
  [[nodiscard]] double range() const { return value_->range; }

 private:
  const std::shared_ptr<RangeValues::Value> value_;
};

}  // namespace doppel
