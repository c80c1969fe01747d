#pragma once
// Values of a sensor's elements, with warnings at their places.

#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/gazebo/sensor_description.h"

namespace doppel {

class SensorValues {
 public:
  // preset: elements that stand in for those that are not written; nullptr: none.
  SensorValues(const XmlNode& element, Diagnostics& diagnostics, const XmlNode* preset = nullptr)
      : element_(element), diagnostics_(diagnostics), preset_(preset) {}

  [[nodiscard]] const XmlNode& element() const { return element_; }
  // Of an element below this one.
  [[nodiscard]] SensorValues below(const XmlNode& element) const {
    return {element, diagnostics_, preset_ == nullptr ? nullptr : preset_->first(element.name)};
  }
  [[nodiscard]] const XmlNode* preset() const { return preset_; }
  // Below this element; an element that is not there has no values. The path is separated by slashes.
  // Names with "gz_", "ignition_", "gz:" or "ignition:" before them are the same.
  [[nodiscard]] const XmlNode* find(const std::string& path) const;
  [[nodiscard]] bool has(const std::string& path) const { return find(path) != nullptr; }
  [[nodiscard]] double number(const std::string& path, double otherwise) const;           // finite
  [[nodiscard]] double distance_or_all(const std::string& path, double otherwise) const;  // "inf" is read
  [[nodiscard]] double within(const std::string& path, double otherwise, double least, double most) const;
  [[nodiscard]] double not_negative(const std::string& path, double otherwise) const;
  [[nodiscard]] int count(const std::string& path, int otherwise) const;  // at least 1
  [[nodiscard]] bool flag(const std::string& path, bool otherwise) const;
  [[nodiscard]] std::string text(const std::string& path, const std::string& otherwise = {}) const;
  [[nodiscard]] Eigen::Vector3d vector(const std::string& path) const;  // x y z
  [[nodiscard]] Pose pose(const std::string& path) const;               // x y z roll pitch yaw
  [[nodiscard]] NoiseDescription noise(const std::string& path) const;
  // A warning at the element of this path.
  void refuse(const std::string& path, const std::string& why) const;

 private:
  void warn(const XmlNode& at, const std::string& what, const std::string& used) const;
  const XmlNode& element_;
  Diagnostics& diagnostics_;
  const XmlNode* preset_;
};

}  // namespace doppel
