#pragma once

#include <map>
#include <string>

#include "pose_extract/extract_poses.h"

// The one home of what makes a photograph, a pose, a campaign good, with its limits. Commands, the live watch
// and the report only show what is decided here: statuses and words of photographs and poses, findings about
// the campaign.

namespace hexcal {

/// Two sources of the scale, or a check distance and its measurement, that differ by more disagree: said
/// aloud.
inline constexpr double kScaleDisagreementSigmas = 3;
/// Beyond this many sigmas a contradiction makes the poses that it concerns suspect: `ok` promises as much.
inline constexpr double kContradictionSigmas = 4;
/// A length whose sigma nobody stated counts as read with a calliper.
inline constexpr double kUnstatedLengthSigmaMm = 0.02;
/// Residuals over what the photographs promise. The corners' own sigmas cover what a camera does to its
/// pictures (two halves of a real board: 0.64, renders: 1.0), so that more is the model's: a lens of another
/// zoom setting leaves 1.85 at 0.08 px, where freed corners take up most of it. Beyond the first it is said,
/// beyond the second something is wrong with the whole, and its poses are suspect. Where these very
/// photographs confirm the camera file's interior orientation (its corrections are within their sigmas),
/// another lens is ruled out, and the sigmas, enlarged by as much, hold what processed pictures leave
/// (`d3200` renders at full size: 1.9 with normalised pose errors of 0.7): then the third is the limit.
inline constexpr double kNoisySigma0 = 1.5;
inline constexpr double kSuspectSigma0 = 1.75;
inline constexpr double kSuspectSigma0OfAConfirmedCamera = 3;

/// Appends to words that are parted by semicolons.
void add_words(std::string& words, const std::string& more);

/// Says of a measured pose, or of a photograph that was used, what contradicts it. One that failed stays as
/// it is, with the words more.
void suspect(MeasuredPose& pose, const std::string& words);
void suspect(MeasuredPhotograph& photograph, const std::string& words);

/// Status and words of each photograph after the adjustment; findings for those that show another pose.
void judge_photographs(const CampaignObservations& observations, CampaignResult& result);

/// Status and words of each pose; takes away poses that must not be trusted.
void judge_poses(const CampaignObservations& observations, const ExtractOptions& options,
                 CampaignResult& result);

/// Findings about the campaign: poses that failed, moved markers, bars and check distances that disagree, a
/// camera that is not as calibrated.
void judge_campaign(const Campaign& campaign, CampaignResult& result);

/// Findings about the sources of the scale (sizes, bars, check distances, nominal coordinates) that
/// contradict each other; the poses are suspect unless a third source knows better.
void judge_scale(const Campaign& campaign, CampaignResult& result);

/// " (a factor of 25.4: inch for mm?)" for a ratio of lengths that is a unit's; else empty.
[[nodiscard]] std::string unit_words(double times);

/// Findings from the commanded poses by id: misspelt ids; frames that are turned against each other; poses
/// that lie where another was to be, as after two folders' names were swapped, which become suspect.
void judge_against_targets(const std::map<std::string, Pose>& commanded, CampaignResult& result);

/// A step in mid-campaign of what the measured poses differ by from the commanded ones (as a smooth function
/// of the pose otherwise): a grip, or the base, moved. Poses after it are suspect.
void judge_target_steps(const std::map<std::string, Pose>& commanded, CampaignResult& result);

/// Poses that turn about another point than the commanded ones, by far: another gd_mm or origin. They are
/// suspect; true if so.
bool judge_origin(const std::map<std::string, Pose>& commanded, CampaignResult& result);

/// The worst of all findings and statuses: good means that every pose and photograph is ok. In a campaign
/// without a moving body folders are no poses and do not count.
[[nodiscard]] Severity overall_verdict(const CampaignResult& result);

}  // namespace hexcal
