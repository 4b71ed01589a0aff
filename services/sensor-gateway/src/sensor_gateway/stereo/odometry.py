"""Stereo visual odometry against key frames: `StereoOdometry.feed` takes a pair and gives a motion or a verdict.

Motions are told from the key frame (``start_time_ns``) to the pair just fed: a motion of the same start replaces
the one before it, and a new start is where the last motion ended. So drift grows with key frames, not with images,
and covariances of successive key frames are nearly independent. A pair without a motion keeps the key frame for a
moment; if sight comes back too late for that, the next motion starts at the new pair, and the chain is broken.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bootprint.messages import CameraMotion, Vector3, upper_triangle
from sensor_gateway.stereo.calibration import FloatArray, StereoCalibration
from sensor_gateway.stereo.health import WORDS, Condition, Look, Verdict, condition_of, look_at, sharpness_of
from sensor_gateway.stereo.images import Image, Pixels, as_grey, evened
from sensor_gateway.stereo.motion import Landmarks, Pose, carried, solve
from sensor_gateway.stereo.recognition import recognised
from sensor_gateway.stereo.right_eye import RightEye
from sensor_gateway.stereo.settings import OdometrySettings
from sensor_gateway.stereo.tracking import find_corners, follow, match_rows
from sensor_gateway.stereo.turned_in import turned_in

_NS_PER_S = 1e9
# Camera axes (right, down, ahead) to body axes (forward, left, up).
_TO_BODY = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
_PLAIN_OF_ALL, _PLAIN_OF_SEEN = 0.15, 0.7
_NEAREST_M = 0.1
_NEAR_CORNERS = 60
_DEEP = 5  # levels of the pyramid: a corner is found again 100 px off
_MOST_STEPS = 6  # ahead of the last pair with a motion: beyond, nobody goes on as they went
_MOST_M_S2, _SLACK_M = 20.0, 0.05  # of a head or a car, over the time from pair to pair
_MOST_STEPS_OFF = 1.2  # of the last step: a pair may be missing, and times may be guesses
_FEW_MATCHED = 0.25  # of the corners: fewer, and the right eye may look elsewhere
_SIGHTLESS: tuple[Condition, ...] = ("dark", "smoke")


@dataclass(frozen=True, slots=True)
class _Pair:
    """A pair of images, evened, and its time."""

    time_ns: int
    left: Image
    right: Image  # straightened
    right_as_seen: Image
    sharpness: float


@dataclass(slots=True)
class _KeyFrame:
    """The pair that motions start from, and the landmarks in its axes."""

    pair: _Pair
    landmarks: Landmarks
    born: int  # how many landmarks it had


@dataclass(frozen=True, slots=True)
class _Seen:
    """Landmarks of the key frame (indices) and their sights (n, 3) now."""

    index: npt.NDArray[np.int64]
    sights: FloatArray


class StereoOdometry:
    """One stereo camera; pure: the same pairs give the same motions."""

    def __init__(self, calibration: StereoCalibration, settings: OdometrySettings | None = None) -> None:
        self._calibration = calibration
        self._settings = OdometrySettings() if settings is None else settings
        self._key: _KeyFrame | None = None
        self._pose = Pose.none()  # of the newest pair with a motion, from the key frame
        self._pose_ns = 0
        self._step = Pose.none()  # from the pair before to that one
        self._step_ns = 0  # how long that took
        self._right_eye = RightEye(calibration)
        self._sequence = 0
        self._told_start_ns: int | None = None  # of the newest motion

    def feed(self, time_ns: int, left: Pixels, right: Pixels) -> CameraMotion | Verdict:
        """Take the next pair: the motion since the key frame, or why there is none."""
        try:
            left_grey, right_grey = as_grey(left), as_grey(right)
            if left_grey.shape != right_grey.shape:
                raise ValueError("left and right differ in size")
        except ValueError as error:
            return Verdict(time_ns, "bad_image", str(error))
        pair = self._pair(time_ns, evened(left_grey), evened(right_grey))
        look = look_at(left_grey)
        if self._key is None or not self._key.pair.time_ns < time_ns:
            return self._begin(pair, look)
        if look.is_dark:
            return self._blind(pair, "dark")
        return self._follow(pair, look, self._key)

    def _pair(self, time_ns: int, left: Image, right: Image) -> _Pair:
        return _Pair(time_ns, left, self._right_eye.straightened(right), right, sharpness_of(left))

    @property
    def key_time_ns(self) -> int | None:
        """The time of the key frame that the next motion starts from."""
        return None if self._key is None else self._key.pair.time_ns

    def restart(self) -> None:
        """Forget the key frame: what was told of it was wrong."""
        self._key = None

    # --- a motion ----------------------------------------------------------------------------------------------

    def _follow(self, pair: _Pair, look: Look, key: _KeyFrame) -> CameraMotion | Verdict:
        seen, pose = self._tracked(pair, key)
        share = 0.0 if pose is None else self._agreeing_share(key, pose)
        if (
            pose is None
            or _agreeing(pose) < self._settings.least_landmarks
            or share < self._settings.least_share
        ):
            depth = float(np.median(key.landmarks.points[:, 2])) if len(key.landmarks) else None
            return self._blind(pair, condition_of(look, depth, share if _agreeing(pose) else None), look)
        self._step, self._step_ns = pose.after(self._pose.inverse()), pair.time_ns - self._pose_ns
        self._pose, self._pose_ns = pose, pair.time_ns
        motion = self._told(key, pose, share, pair.time_ns)
        if self._needs_key(key, pose, seen, pair):
            self._move_key(pair, key, pose, seen)
        return motion

    def _tracked(self, pair: _Pair, key: _KeyFrame) -> tuple[_Seen, Pose | None]:
        """Landmarks followed and the pose they agree on: near where motion leads, else further and further around.

        Near first, for patterns repeat themselves. What was lost is looked for again where the pose says it is.
        """
        best: tuple[_Seen, Pose | None] = (_Seen(np.zeros(0, dtype=np.int64), np.zeros((0, 3))), None)
        onward = self._onward(pair.time_ns)
        for guess, levels in self._guesses(pair, key, onward):
            seen = self._look(pair, key, guess, levels)
            pose = self._solve(key, seen, guess)
            if pose is not None and not self._is_bearable(pose, onward, pair.time_ns):
                continue
            if _agreeing(pose) > _agreeing(best[1]):
                best = (seen, pose)
            if pose is not None and self._is_plain(pose, key):
                break
        if best[1] is not None and _agreeing(best[1]) < 0.8 * len(key.landmarks):
            seen = self._look(pair, key, best[1], levels=1)
            pose = self._solve(key, seen, best[1])
            if _agreeing(pose) > _agreeing(best[1]):
                best = (seen, pose)
        return best

    def _guesses(self, pair: _Pair, key: _KeyFrame, onward: Pose) -> Iterator[tuple[Pose, int]]:
        """Where the camera may be, and how many levels of the pyramid lead there."""
        yield from ((onward, 2), (onward, _DEEP), (self._pose, _DEEP), (Pose.none(), _DEEP))
        index, pixels = recognised(key.pair.left, key.landmarks.pixels, pair.left)
        blind = np.full((len(index), 1), np.nan)
        found = self._solve(key, _Seen(index, np.hstack([pixels, blind])), onward)
        if found is not None:
            yield found, 2

    def _onward(self, time_ns: int) -> Pose:
        """Where steps like the last one lead."""
        since = (time_ns - self._pose_ns) / self._step_ns if self._step_ns > 0 else 1.0
        onward = self._pose
        for _ in range(min(_MOST_STEPS, max(1, round(since)))):
            onward = self._step.after(onward)
        return onward

    def _is_bearable(self, pose: Pose, onward: Pose, time_ns: int) -> bool:
        """Whether somebody can have been pushed so: a wall of alike tiles fits a tile further on as well."""
        seconds = (time_ns - self._pose_ns) / _NS_PER_S
        most_m = _SLACK_M + _MOST_M_S2 * seconds**2
        most_m += _MOST_STEPS_OFF * float(np.linalg.norm(self._step.place))
        return self._step_ns <= 0 or float(np.linalg.norm(pose.place - onward.place)) <= most_m

    def _look(self, pair: _Pair, key: _KeyFrame, guess: Pose, levels: int) -> _Seen:
        """Follow the key frame's landmarks into the left image now, and from there into the right one."""
        points = guess.points(key.landmarks.points)
        ahead = np.flatnonzero(points[:, 2] > _NEAREST_M)
        foretold = self._calibration.sights(points[ahead])
        left, found = follow(
            key.pair.left, pair.left, key.landmarks.pixels[ahead], foretold[:, :2], levels=levels
        )
        index, left = ahead[found], left[found]
        shift = np.column_stack([foretold[found, 2] - foretold[found, 0], np.zeros(len(index))])
        right, matched = follow(pair.left, pair.right, left, left + shift, levels=2)
        matched &= np.abs(right[:, 1] - left[:, 1]) < 2.0
        disparity = left[:, 0] - right[:, 0]
        matched &= disparity > 0.0
        return _Seen(index, np.column_stack([left, np.where(matched, right[:, 0], np.nan)]))

    def _is_plain(self, pose: Pose, key: _KeyFrame) -> bool:
        """Whether so many agree that no other explanation is looked for: many of those seen, or of all."""
        agreeing = _agreeing(pose)
        enough = max(2 * self._settings.least_landmarks, _PLAIN_OF_ALL * len(key.landmarks))
        return agreeing >= enough and agreeing >= _PLAIN_OF_SEEN * len(pose.agree)

    def _solve(self, key: _KeyFrame, seen: _Seen, guess: Pose) -> Pose | None:
        landmarks = key.landmarks.chosen(seen.index)
        return solve(self._calibration, landmarks, seen.sights, self._settings.sight_sigma_px, guess)

    def _agreeing_share(self, key: _KeyFrame, pose: Pose) -> float:
        """Of the landmarks that should be in view from there, how many are seen where they should be.

        What moves by itself either disagrees or hides what is behind it; both count.
        """
        points = pose.points(key.landmarks.points)
        sights = self._calibration.sights(points[points[:, 2] > _NEAREST_M])[:, :2]
        height, width = key.pair.left.shape
        expected = ((sights >= 0.0) & (sights <= (width - 1, height - 1))).all(axis=1).sum()
        return min(1.0, _agreeing(pose) / max(1, int(expected)))

    def _told(self, key: _KeyFrame, pose: Pose, share: float, time_ns: int) -> CameraMotion:
        """The message: where the camera is in the key frame's body axes, and how sure; less so in a crowd."""
        back = pose.rotation.inv()
        turn = _TO_BODY @ back.as_matrix()
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = turn @ pose.covariance[3:, 3:] @ turn.T
        covariance[3:, 3:] = turn @ pose.covariance[:3, :3] @ turn.T
        covariance[:3, 3:] = turn @ pose.covariance[3:, :3] @ turn.T
        covariance[3:, :3] = covariance[:3, 3:].T
        translation, rotation = _TO_BODY @ pose.place, _TO_BODY @ back.as_rotvec()
        covariance[:3, :3] += self._settings.scale_sigma**2 * float(translation @ translation) * np.eye(3)
        covariance[3:, 3:] += self._settings.turn_sigma**2 * float(rotation @ rotation) * np.eye(3)
        landmarks = self._sure_landmarks(key) if self._told_start_ns != key.pair.time_ns else None
        self._told_start_ns = key.pair.time_ns
        self._sequence += 1
        return CameraMotion(
            time_ns=time_ns,
            sequence=self._sequence - 1,
            start_time_ns=key.pair.time_ns,
            translation_m=_vector(translation),
            rotation_rad=_vector(rotation),
            covariance=upper_triangle(covariance / share**2),
            confidence_pct=100.0 * share,
            landmarks_m=landmarks,
        )

    def _sure_landmarks(self, key: _KeyFrame) -> tuple[Vector3, ...]:
        """Some of the key frame's landmarks that are well placed, in body axes, spread over all of them."""
        points = key.landmarks.points
        spread = self._calibration.spread(points, key.landmarks.covariances)
        sure = points[np.sqrt(spread[:, 2, 2]) < self._settings.told_landmark_sigma_m]
        chosen = sure[:: 1 + len(sure) // self._settings.told_landmarks] @ _TO_BODY.T
        return tuple(_vector(point) for point in chosen)

    # --- key frames --------------------------------------------------------------------------------------------

    def _needs_key(self, key: _KeyFrame, pose: Pose, seen: _Seen, pair: _Pair) -> bool:
        settings = self._settings
        if self._is_blurred(pair, key) and _agreeing(pose) >= 2 * settings.least_landmarks:
            return False  # corners of a blurred view lie anywhere
        agreeing = seen.sights[pose.agree, :2]
        shift = np.linalg.norm(agreeing - key.landmarks.pixels[seen.index[pose.agree]], axis=1)
        return (
            len(agreeing) < settings.key_share * key.born
            or bool(np.median(shift) > settings.key_parallax_rad * self._calibration.focal_x_px)
            or float(pose.rotation.magnitude()) > settings.key_turn_rad
            or pair.time_ns - key.pair.time_ns > settings.longest_key_s * _NS_PER_S
        )

    def _is_blurred(self, pair: _Pair, key: _KeyFrame) -> bool:
        return pair.sharpness < self._settings.blurred * key.pair.sharpness

    def _move_key(self, pair: _Pair, key: _KeyFrame, pose: Pose, seen: _Seen) -> None:
        """The newest pair becomes the key frame; landmarks that agree come along."""
        agreeing, sights = key.landmarks.chosen(seen.index[pose.agree]), seen.sights[pose.agree]
        sigma_px = self._settings.sight_sigma_px
        landmarks = carried(self._calibration, agreeing, sights, pose, sigma_px)
        turn = turned_in(self._calibration, agreeing, sights, pose, sigma_px)
        if turn is not None and self._right_eye.learn_turn(*turn):
            pair = self._pair(pair.time_ns, pair.left, pair.right_as_seen)
        self._set_key(pair, landmarks.chosen(self._is_placed(landmarks)))

    def _is_placed(self, landmarks: Landmarks) -> npt.NDArray[np.bool_]:
        disparity = self._calibration.disparity(self._calibration.sights(landmarks.points))
        return np.asarray(disparity >= 0.5 * self._settings.least_disparity_px)

    def _set_key(self, pair: _Pair, kept: Landmarks) -> None:
        settings = self._settings
        wanted = settings.most_landmarks - len(kept)
        corners = find_corners(pair.left, kept.pixels, wanted, (settings.columns, settings.rows))
        pair, placed = self._placed(pair, corners)
        landmarks = kept.with_more(placed)
        self._key = _KeyFrame(pair, landmarks, len(landmarks))
        self._pose, self._pose_ns = Pose.none(), pair.time_ns

    def _placed(self, pair: _Pair, corners: FloatArray) -> tuple[_Pair, Landmarks]:
        """Corners (n, 2) that the right eye sees too, as landmarks; rows tell how that eye looks."""
        sights, rows, sure = self._matched(pair, corners)
        if sure.sum() < _FEW_MATCHED * len(corners):
            self._right_eye.forget()
            sights, rows, sure = self._matched(pair, corners)
        right = np.column_stack([sights[sure, 2], rows[sure]])
        if self._right_eye.learn(corners[sure], right):
            pair = self._pair(pair.time_ns, pair.left, pair.right_as_seen)
            sights, rows, sure = self._matched(pair, corners)
        sure[sure] &= self._calibration.disparity(sights[sure]) >= self._settings.least_disparity_px
        points = self._calibration.points(sights[sure])
        doubt = np.tile(self._settings.sight_sigma_px**2 * np.eye(3), (len(points), 1, 1))
        return pair, Landmarks(corners[sure], points, doubt)

    def _matched(
        self, pair: _Pair, corners: FloatArray
    ) -> tuple[FloatArray, FloatArray, npt.NDArray[np.bool_]]:
        most_px = int(self._settings.largest_disparity * pair.left.shape[1])
        return match_rows(pair.left, pair.right, corners, most_px, self._right_eye.rows_aside)

    def _begin(self, pair: _Pair, look: Look) -> Verdict:
        """A key frame out of nothing."""
        self._step, self._step_ns = Pose.none(), 0
        nothing = Landmarks(np.zeros((0, 2)), np.zeros((0, 3)), np.zeros((0, 3, 3)))
        self._set_key(pair, nothing)
        assert self._key is not None
        if len(self._key.landmarks) >= self._settings.least_landmarks and not look.is_dark:
            return Verdict(pair.time_ns, "starting", WORDS["starting"])
        self._key = None
        condition = condition_of(look, self._nearness_m(pair), None)
        return Verdict(pair.time_ns, condition, WORDS[condition])

    def _nearness_m(self, pair: _Pair) -> float | None:
        """Median depth of what both eyes see, however near; None if that is nothing."""
        corners = find_corners(pair.left, np.zeros((0, 2)), _NEAR_CORNERS, (4, 3))
        sights, _, sure = match_rows(pair.left, pair.right, corners, pair.left.shape[1])
        sure[sure] &= self._calibration.disparity(sights[sure]) > 0.0
        return float(np.median(self._calibration.points(sights[sure])[:, 2])) if sure.any() else None

    def _blind(self, pair: _Pair, condition: Condition, look: Look | None = None) -> Verdict:
        """No motion: hold on to the key frame for a moment, then begin anew where something is to be seen.

        While nothing is to be seen the key frame may yet be recognised.
        """
        assert self._key is not None
        sightless = condition in _SIGHTLESS or self._is_blurred(pair, self._key)
        patience_s = self._settings.remembered_s if sightless else self._settings.longest_gap_s
        if pair.time_ns - self._pose_ns > patience_s * _NS_PER_S:
            self._key = None
            if look is not None:
                self._begin(pair, look)
        return Verdict(pair.time_ns, condition, WORDS[condition])


def _agreeing(pose: Pose | None) -> int:
    return 0 if pose is None else int(pose.agree.sum())


def _vector(values: FloatArray) -> Vector3:
    return float(values[0]), float(values[1]), float(values[2])
