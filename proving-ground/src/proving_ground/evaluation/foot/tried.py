"""What was tried on the foot INS without gain, and what is known of the errors that are left: prose of the page."""

TRIED = """## Tried without gain

- **A delay between gyro and accelerometer.** 2.5 to 6 ms would take the height drift away, another amount for every
  set; but the innovations of walking ask for none (their likelihood is best at -5 to 0 ms; of running at +5), and
  motion capture shows why: on the walks of 2017-11-22 the height is right to 2 mm until the foot touches down and
  jumps by 7 mm within the first 40 ms of stance, while it still sinks at 5 to 10 cm/s. So the drift is now met
  where it arises, by the sole's expected motion.
- **Gyro scale.** The likelihood of the innovations asks for -1 to +1 %, of either sign with the same sensor, and
  +2 % on one foot: no state for it.
- **Noise that grows faster than the detector's sigma**, which leaves the first milliseconds of stance out: better
  height when walking, lost strides when running.
- **Another noise for the vertical** as one more output of the network: no gain on feet it had not seen.
- **Mean motion and sigma trained together**: worse tracks; sigma is trained first and stays.
- **Sigma of the sole instead of the marker, from all three sets with motion capture**: vicon trials unseen in
  training 0.067 m in the mean instead of 0.071, foot-gcp the same, but a stride too many on walk 43 and a turning
  table taken for a stance.
- **All of the learned mean motion**: lower height errors on xio-gait, gaitmap-example and dualfoot-fgo (0.24, 0.18,
  0.36 m), but the level walks of foot-gcp then sink by as much as they rose.

Not tried: a prior for level floors, which would flatten ramps.

gaitmap-example: the heel's marker and the sensor are two points of the foot, 11 cm apart on the left and 16 cm on
the right by the best fit in the foot's own axes; on a way out and back that alone is most of the error. With that
offset fitted 0.08 m and 0.16 m remain; no offset is fitted in any figure here.

Walk 31 of foot-gcp: fitted to its first 30 points this filter is off by 8 cm (RMSE) there; point 30 then lies
0.66 m aside (the tiles are 0.60 m) and points 31 to 33 lie 1.1 m too near, all alike (two tiles are 1.19 m). The
other system's track of the same samples gives these strides nearly our lengths (0.75 and 0.76 m for one that the
survey calls 1.32 m). So its end error of 2 % is taken for the survey's. It stays in all figures."""
