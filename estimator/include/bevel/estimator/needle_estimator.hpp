// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// NeedleFilter over a bounded history ordered by time: measurements that arrive delayed or out of order are applied at
/// their capture time, and the later history is recomputed. Shuffled input gives the same state as sorted input, bit
/// for bit.
///
/// Actuator states and measurements become nodes ordered by time. A measurement between two actuator states is applied
/// at positions interpolated between them; one that is newer than the newest actuator state waits for the next. Two
/// actuator states farther apart than AxisLimits::gap_s are the ends of a gap. Measurements within a gap are not
/// applied, since the position of the axes is unknown, and the state crosses it by NeedleFilter::pass_gap, a declared
/// reset.
#include <cstdint>
#include <memory>
#include <vector>

#include <bevel/estimator/past.hpp>

namespace bevel::estimator {

/// Number of measurements of one kind by what became of them.
struct ReadingCounters {
  std::int64_t offered = 0;     ///< given to NeedleEstimator::add
  std::int64_t not_usable = 0;  ///< ignored: status other than 0, or no information
  std::int64_t too_old = 0;     ///< ignored: older than the history
  std::int64_t duplicate = 0;   ///< ignored: time, camera and number of a measurement in the history
  std::int64_t late = 0;        ///< arrived after a newer node; the history was rolled back
  std::int64_t in_gap = 0;      ///< not applied: taken within a gap (AxisLimits::gap_s)
};

/// Numbers of samples and of recomputations since construction.
struct Counters {
  ReadingCounters positions,           ///< position measurements
      headings;                        ///< heading measurements
  std::int64_t relinearised = 0;       ///< successful calls of NeedleFilter::relinearise
  std::int64_t actuators = 0;          ///< actuator states given to NeedleEstimator::add
  std::int64_t actuators_refused = 0;  ///< ignored: not newer than the oldest node, or the time of another
};

/// Estimate at the newest actuator state, with the result of the newest position measurement.
struct Estimate {
  std::int64_t utime = 0;   ///< time for which the estimate holds, us; 0 before the first actuator state
  FilterState state;        ///< state of the filter
  model::Pose tip;          ///< NeedleFilter::tip_pose of the state, {A}, mm
  Update newest_update;     ///< result of the newest position measurement
  std::int32_t health = 0;  ///< bits of Health; 0: healthy
};

struct HealthFinding;

/// Estimates the needle from actuator states and measurements in any order of arrival.
///
/// The class reads no clock. The size of its containers is fixed at construction.
class NeedleEstimator {
 public:
  /// Constructs the estimator; the estimate begins with the first actuator state.
  /// @param config configuration of the filter; copied
  /// @param history number of nodes kept, at least 8. With actuators at 100 Hz and two cameras at 30 Hz, 64 nodes are
  ///     0.4 s, or 0.3 s if each camera measures headings too.
  explicit NeedleEstimator(const EstimatorConfig& config, std::size_t history = 64);

  /// Adds an actuator state and applies the measurements that wait for it. It is counted and ignored if it is not newer
  /// than the oldest node, or if the history has one of the same time.
  /// @param actuator positions of the axes, mm and rad, at their time, us
  void add(const model::ActuatorState& actuator);

  /// Adds a position measurement. It is counted and ignored if its status is not 0, if it has no information, if it is
  /// older than the history, or if the history has it already (ReadingCounters).
  /// @param measurement tip position in {A}, mm, at its capture time, us; finite values
  void add(const model::TipMeasurement& measurement);

  /// Adds a heading measurement, under the same conditions as a position.
  /// @param heading unit vector in {A} at its capture time, us; finite values
  void add(const model::TipHeading& heading);

  /// Discards the history and begins a new estimate with the next actuator state. A declared reset.
  void restart();

  /// Sets the numbers of measurements rejected in a row to zero, for each source. For an operator's arm command: a
  /// source that is still rejected is reported again after Gate::rejects_before_unhealthy.
  void forget_rejects();

  /// Shifts all time stamps after the clock of the samples was set. The estimate is kept. A declared reset.
  /// @param by_us change of the clock, us
  void shift_time(std::int64_t by_us);

  /// Returns the newest estimate, at the newest actuator state.
  /// @param now_utime current time, us, for the age limits of the health word only; in a replay, the newest sample's
  /// @return estimate; before the first actuator state its time is 0 and it is unhealthy
  Estimate estimate(std::int64_t now_utime) const;

  /// Finds the first bit of \p estimate's health word that forbids steering, with its value and its limit.
  /// @param estimate estimate of this estimator
  /// @param now_utime current time, us, as for the estimate
  /// @return the finding; its flag is kHealthy if estimate() set none of these bits
  HealthFinding finding(const Estimate& estimate, std::int64_t now_utime) const;

  /// Predicts the estimate to a time after the newest actuator state. Measurements that wait for the axes are applied;
  /// the history does not change.
  /// @param axes predicted positions of the axes, mm and rad, at the time of the prediction, us
  /// @param now_utime current time, us, for the age limits of the health word
  /// @return estimate at that time; estimate() if the time is not newer than the newest node
  Estimate estimate_ahead(const model::ActuatorState& axes, std::int64_t now_utime) const;

  /// A measurement and the state it was applied to, for the statistics of a replay.
  struct Applied {
    std::int64_t utime;                        ///< time of the measurement, us
    std::int32_t camera;                       ///< number of its camera
    FilterState state_before;                  ///< state at that time, before the update
    Update update;                             ///< result of the update
    const model::TipMeasurement* measurement;  ///< the position, or null for a heading; valid during the call
    const model::TipHeading* heading;          ///< the heading, or null for a position; valid during the call
  };
  /// Callback for measurements; the first argument is the context given to observe().
  using Observer = void (*)(void* context, const Applied&);
  /// Sets a callback that is called once for each measurement, when it is first applied, and not when the history is
  /// recomputed.
  /// @param observer function to call; null for none
  /// @param context first argument of each call
  void observe(Observer observer, void* context) { observer_ = observer, observer_context_ = context; }

  /// Returns the counters.
  /// @return numbers since construction
  const Counters& counters() const { return counters_; }
  /// Returns the filter.
  /// @return filter of this estimator
  const NeedleFilter& filter() const { return filter_; }

 private:
  /// Measurements rejected in a row: the most of one source, and of all sources together.
  struct Rejects {
    std::int32_t of_one = 0, of_all = 0;
  };
  Rejects rejects_in_row(const FilterState& state, std::int64_t now_utime) const;
  // Insertion after which the past is relinearised.
  static constexpr double kFirstRelinearisation_mm = 30;
  static constexpr double kRelinearisedEvery_mm = 15;
  // Smallest retraction: a stationary axis reports less.
  static constexpr double kDrawnBack_mm = 0.01;
  enum class Kind : std::uint8_t { actuator, position, heading };
  // Positions and status of an actuator state.
  struct Reported {
    std::int64_t utime = 0;
    double insertion_mm = 0, rotation_rad = 0;
    std::array<std::int32_t, 2> status{};
  };
  struct Node {
    std::int64_t utime = 0;
    Kind kind = Kind::actuator;
    std::int32_t camera = 0;
    std::int64_t seq = 0;
    bool applied_before = false;
    bool counted_in_gap = false;
    bool rejects_forgotten = false;  // its rejection does not count when it is applied again
    Reported axes;                   // newest actuator state up to this node
    double insertion_mm = 0;
    double rotation_rad = 0;
    Moved moved;                        // motion by the model since the previous node
    model::TipMeasurement measurement;  // if kind is position
    model::TipHeading heading;          // if kind is heading
    FilterState state;
    Update update;
  };

  Node& node(std::size_t i) { return pool_[order_[i]]; }
  const Node& node(std::size_t i) const { return pool_[order_[i]]; }
  Node* insert(std::int64_t utime, Kind kind, std::int32_t camera, std::int64_t seq, std::size_t& index);
  template <class Reading>
  void add_reading(Kind kind, Reading reading, const Eigen::Matrix3d& information, Reading Node::*member);
  ReadingCounters& counters_of(Kind kind) { return kind == Kind::heading ? counters_.headings : counters_.positions; }
  void process_from(std::size_t index);
  void drop_oldest();
  void remember(const Node& before, const Node& node);
  void restart_past(const FilterState& start);
  void relinearise_if_due();
  bool interpolate(std::size_t index);
  bool is_gap(const Reported& from, const Reported& to) const;
  Estimate describe(const FilterState& state, std::int64_t utime, const Update& newest_update,
                    std::int64_t now_utime) const;

  NeedleFilter filter_;
  std::vector<Node> pool_;            // sized once
  std::vector<std::uint32_t> order_;  // indices into the pool, by time; reserved once
  std::vector<std::uint32_t> free_;
  std::size_t processed_ = 0;             // nodes before this index hold a posterior
  Past past_;                             // steps that have left the history, since the start or the last reset
  double known_heading_sd_rad_;           // largest, rad, at which the past begins
  std::unique_ptr<WalkedStep[]> walked_;  // work space of relinearise(); sized once, uninitialised
  bool past_started_ = false;
  bool past_waits_ = false;        // the needle is retracted
  bool past_begins_anew_ = false;  // the pose was reset while it was
  struct {
    double insertion_mm, rotation_rad;
  } left_{};                                 // axes when the retraction began
  std::array<double, 2> forgotten_since_{};  // of cameras 0 and 1, since the last measurement of each in the past
  double past_mm_ = 0;                       // insertion and retraction in the past
  double past_due_mm_ = kFirstRelinearisation_mm;
  Counters counters_;
  Update newest_update_;
  std::int64_t newest_update_utime_ = 0;
  std::int32_t resets_before_ = 0;  // declared by restarts
  bool restarted_ = false;          // the next actuator state is the first after one
  Observer observer_ = nullptr;
  void* observer_context_ = nullptr;
};

}  // namespace bevel::estimator
