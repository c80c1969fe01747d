#include "doppel/ros/messages/codec.h"
#include "doppel/ros/messages/type_description.h"
#include "doppel/ros/messages/type_hash.h"

namespace doppel {

const TypeDescription& description_of(const TypeSupport& type, Distro distro) {
  return *type.description_in(distro);
}

std::string TypeSupport::schema() const {
  return schema_text(*description());
}

Status TypeSupport::yaml_to_cdr(std::string_view yaml, Bytes& out) const {
  return doppel::yaml_to_cdr(*description(), yaml, out);
}

Status TypeSupport::json_to_cdr(std::string_view json, Bytes& out) const {
  return doppel::json_to_cdr(*description(), json, out);
}

Status TypeSupport::cdr_to_yaml(std::span<const std::byte> cdr, std::string& out) const {
  return doppel::cdr_to_yaml(*description(), cdr, out);
}

Status TypeSupport::cdr_to_json(std::span<const std::byte> cdr, std::string& out) const {
  return doppel::cdr_to_json(*description(), cdr, out);
}

Status TypeSupport::recode(std::span<const std::byte> cdr, Bytes& out) const {
  return recode_cdr(*description(), cdr, out);
}

const std::string& TypeSupport::hash(Distro distro) const {
  return hashes_[static_cast<std::size_t>(distro)].get([&] { return type_hash(*description_in(distro)); });
}

const std::string& ServiceSupport::hash() const {
  return late_hashes[static_cast<std::size_t>(ros_distro())].get([this] { return service_type_hash(*this); });
}

const std::string& ActionSupport::hash() const {
  return late_hashes[static_cast<std::size_t>(ros_distro())].get([this] { return action_type_hash(*this); });
}

}  // namespace doppel
