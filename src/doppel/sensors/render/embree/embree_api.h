#pragma once
// Embree 3 (Debian 12) or Embree 4 (Debian 13): the calls with other arguments. The structures of rays, hits
// and buffers are equal.

#if __has_include(<embree4/rtcore.h>)

#include <embree4/rtcore.h>

namespace doppel::embree {

// The flags of the queries of one packet.
class IntersectQuery {
 public:
  static IntersectQuery coherent() {
    IntersectQuery out;
    out.arguments_.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    return out;
  }
  void intersect(const int* valid, RTCScene scene, RTCRayHit8* rays) {
    rtcIntersect8(valid, scene, rays, &arguments_);
  }
  void intersect(const int* valid, RTCScene scene, RTCRayHit16* rays) {
    rtcIntersect16(valid, scene, rays, &arguments_);
  }

 private:
  IntersectQuery() { rtcInitIntersectArguments(&arguments_); }
  RTCIntersectArguments arguments_;
};

class OccludeQuery {
 public:
  OccludeQuery() { rtcInitOccludedArguments(&arguments_); }
  void occlude(RTCScene scene, RTCRay* ray) { rtcOccluded1(scene, ray, &arguments_); }
  void occlude(const int* valid, RTCScene scene, RTCRay8* rays) {
    rtcOccluded8(valid, scene, rays, &arguments_);
  }
  void occlude(const int* valid, RTCScene scene, RTCRay16* rays) {
    rtcOccluded16(valid, scene, rays, &arguments_);
  }

 private:
  RTCOccludedArguments arguments_;
};

}  // namespace doppel::embree

#else

#include <embree3/rtcore.h>

namespace doppel::embree {

// The flags of the queries of one packet.
class IntersectQuery {
 public:
  static IntersectQuery coherent() {
    IntersectQuery out;
    out.context_.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    return out;
  }
  void intersect(const int* valid, RTCScene scene, RTCRayHit8* rays) {
    rtcIntersect8(valid, scene, &context_, rays);
  }
  void intersect(const int* valid, RTCScene scene, RTCRayHit16* rays) {
    rtcIntersect16(valid, scene, &context_, rays);
  }

 private:
  IntersectQuery() { rtcInitIntersectContext(&context_); }
  RTCIntersectContext context_;
};

class OccludeQuery {
 public:
  OccludeQuery() { rtcInitIntersectContext(&context_); }
  void occlude(RTCScene scene, RTCRay* ray) { rtcOccluded1(scene, &context_, ray); }
  void occlude(const int* valid, RTCScene scene, RTCRay8* rays) {
    rtcOccluded8(valid, scene, &context_, rays);
  }
  void occlude(const int* valid, RTCScene scene, RTCRay16* rays) {
    rtcOccluded16(valid, scene, &context_, rays);
  }

 private:
  RTCIntersectContext context_;
};

}  // namespace doppel::embree

#endif
