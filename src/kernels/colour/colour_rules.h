/// The numbers of the rules that paint surfaces: defaults, units, and why they are so.
#pragma once

#include <cstdint>

namespace dtsdf {

struct ColourRules {
  /// Voxels no farther from their surface than this are painted, in voxels: the two ends of an edge
  /// that the surface crosses are a voxel off at most, and noise may add to that.
  float painted_distance = 1.1f;
  /// A direction's voxel is painted if the surface faces it as much as any, less this (difference
  /// of cosines). Others' colours would be the same once more, but a vertex that lies by them has
  /// its own from there. (RMSE at the vertices at 10 mm, waves of colour: dragon 3.60 with 0.1,
  /// 3.03 with 0.45 and with 0.7; armadillo 2.50, 1.63 and 1.60. Colour takes 13 and 14 % of
  /// redkitchen's map with 0.1 and 0.45.)
  float facing_slack = 0.45f;
  /// Surfaces seen at a smaller cosine between normal and ray are not painted: they may be those of
  /// a back. Grazing views weigh next to nothing beside others, but floors far away have no other.
  /// (A house in waves of colour, voxels of 25 mm: RMSE in CIE Lab 18.2 with 0.2, where 8.6 % of
  /// the vertices stayed unpainted, and 9.2 with this.)
  float least_cosine = 0.02f;

  /// Voxels no farther from their surface than this hide what is behind, in voxels: more than half,
  /// so that there is one for each place of the surface ...
  float hiding_distance = 0.6f;
  /// ... each hiding so much to every side, in voxels: less would leave gaps, more hides what is
  /// beside an outline. (Dragon in waves of colour at 20 mm: RMSE in CIE Lab 6.1 with 0.75 and a
  /// hidden_depth of 1.5, 4.7 with 0.5.)
  float hiding_radius = 0.5f;
  /// What lies behind a surface by more than this is hidden, in voxels: less is the roughness of
  /// the surface itself ...
  float hidden_depth = 2.0f;
  /// ... plus so much at 1 m, in 1/m, growing with z^2: what noise leaves of roughness. By
  /// judgement, some three deviations of a depth camera that triangulates.
  float hidden_noise = 0.004f;
  /// As near as this to the outline of what is in front of a point, in pixels, pixels mix both, and
  /// cameras are not registered to the pixel. ...
  float outline_px = 2.0f;
  /// ... Such a view counts for this share: next to nothing, but corners that are never seen free
  /// have no other. (Dragon in waves of colour at 20 mm: RMSE in CIE Lab 8.4
  /// with 0.)
  float beside_nearer_share = 0.002f;

  /// A surface is beside its own outline if something farther away, or nothing, is seen within this
  /// many voxels (and outline_px) of it, ...
  float outline_voxels = 1.5f;
  /// ... by more than so many voxels in depth. ...
  float outline_depth = 3.0f;
  /// ... Such a view counts for this share: a thin thing has no other, but what was seen from
  /// another side has a better one.
  float outline_share = 0.05f;

  /// Depth in metres up to which a view has its full weight, as in fusion; beyond, it falls as
  /// z^-2.
  float full_weight_depth_m = 1.0f;
  /// Pixels are averaged over squares of about this side, in voxels: finer detail is lost in the
  /// map anyhow, and would show as noise.
  float sample_width = 0.5f;
  /// Views that a colour is the mean of, at most, by weight: what is seen as well later goes on
  /// counting.
  int32_t most_views = 8;

  /// The exposure of an image is judged where the map is painted already, from so many voxels on:
  /// by judgement, a small part of an image.
  int32_t least_overlap = 256;
  /// Gains that differ from 1 by no more than this in any channel are no other exposure. (Armadillo
  /// in waves of colour, 60 images of one exposure, voxels of 20 mm: median error 2.4 in CIE Lab
  /// without this and with all voxels in the sums, 0.8 without any correction.)
  float same_gain = 0.03f;
};

}  // namespace dtsdf
