#include "evaluation/mesh_scene.h"

#include <embree3/rtcore.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "meshing/surface_distance.h"

namespace dtsdf {

namespace {

Vec3f toVec(const Eigen::Vector3f& p) { return {p.x(), p.y(), p.z()}; }

RTCRay rayFrom(const Eigen::Vector3f& from, const Eigen::Vector3f& direction, float end) {
  RTCRay ray{};
  ray.org_x = from.x();
  ray.org_y = from.y();
  ray.org_z = from.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tfar = end;
  ray.mask = ~0u;
  return ray;
}

/// State of a closest-point query, updated triangle by triangle.
struct Query {
  const TriangleMesh* mesh;
  Vec3f p;
  double squared_distance;
  uint32_t triangle;
};

bool visitTriangle(RTCPointQueryFunctionArguments* arguments) {
  Query& query = *static_cast<Query*>(arguments->userPtr);
  const auto& triangle = query.mesh->triangles[arguments->primID];
  const auto corner = [&](size_t i) { return toVec(query.mesh->vertices[triangle[i]]); };
  const double squared_distance =
      squaredDistanceOfTriangle(query.p, corner(0), corner(1), corner(2));
  if (!(squared_distance < query.squared_distance)) return false;
  query.squared_distance = squared_distance;
  query.triangle = arguments->primID;
  // Rounded up, so that no nearer triangle is culled.
  arguments->query->radius = static_cast<float>(std::sqrt(squared_distance)) * 1.00001f;
  return true;
}

}  // namespace

MeshScene::MeshScene(const TriangleMesh& mesh)
    : mesh_(mesh),
      device_(rtcNewDevice(nullptr), rtcReleaseDevice),
      scene_(nullptr, rtcReleaseScene) {
  if (mesh.triangles.empty()) throw std::runtime_error("the mesh has no triangles");
  if (device_ == nullptr) throw std::runtime_error("Embree cannot create a device");
  for (const Eigen::Vector3f& p : mesh.vertices) bounds_.extend(p);
  scene_.reset(rtcNewScene(device_.get()));
  // In robust mode, no ray passes between two adjacent triangles.
  rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           3 * sizeof(float), mesh.vertices.size());
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(uint32_t), mesh.triangles.size());
  if (vertices == nullptr || indices == nullptr) throw std::runtime_error("Embree: out of memory");
  static_assert(sizeof(mesh.vertices[0]) == 3 * sizeof(float), "a vertex must be three floats");
  std::memcpy(vertices, static_cast<const void*>(mesh.vertices.data()),
              mesh.vertices.size() * 3 * sizeof(float));
  std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * 3 * sizeof(uint32_t));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_.get(), geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_.get());
  if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE) {
    throw std::runtime_error("Embree could not build the scene for the mesh");
  }
}

Eigen::Vector3f MeshScene::triangleNormal(uint32_t triangle) const {
  const auto& corners = mesh_.triangles[triangle];
  const auto& vertices = mesh_.vertices;
  return (vertices[corners[1]] - vertices[corners[0]])
      .cross(vertices[corners[2]] - vertices[corners[0]])
      .normalized();
}

std::optional<RayHit> MeshScene::intersect(const Eigen::Vector3f& origin,
                                           const Eigen::Vector3f& direction) const {
  RTCRayHit query{};
  query.ray = rayFrom(origin, direction, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_.get(), &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return RayHit{query.ray.tfar,
                query.hit.primID,
                triangleNormal(query.hit.primID),
                {query.hit.u, query.hit.v}};
}

bool MeshScene::isFree(const Eigen::Vector3f& from, const Eigen::Vector3f& to, float margin) const {
  RTCRay ray = rayFrom(from, to - from, 1.0f - margin);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene_.get(), &context, &ray);
  return ray.tfar >= 0.0f;  // Embree sets it to minus infinity if the ray is blocked.
}

ClosestPoint MeshScene::closestPoint(const Eigen::Vector3f& p) const {
  Query found{&mesh_, toVec(p), std::numeric_limits<double>::infinity(), 0};
  RTCPointQuery query{};
  query.x = p.x();
  query.y = p.y();
  query.z = p.z();
  query.radius = std::numeric_limits<float>::infinity();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_.get(), &query, &context, visitTriangle, &found);
  return {std::sqrt(found.squared_distance), found.triangle};
}

}  // namespace dtsdf
