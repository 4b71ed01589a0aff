"""The watch's screen (Textual): own place, alarms, friends, a line to type orders; for small terminals."""

from collections.abc import Callable, Iterable
from typing import ClassVar, Final

from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import DataTable, Input, Static

from bootprint.bus import Envelope
from bootprint.errors import BootprintError
from bootprint.messages import Message
from bootprint.watch.orders import USAGE, message_of
from bootprint.watch.view import Friend, WatchView

_LOOK_S: Final = 0.25
_MOST_FRIENDS: Final = 20
_STYLES: Final = {"fresh": "", "stale": "yellow", "lost": "bold red"}
_HELP: Final = "a alert · s status · o seen · x here · q quit"


class Watch(App[None]):
    """``take`` gives what waits on the bus, ``send`` says something, ``now_ns`` is event time."""

    CSS = """
    #own { height: auto; padding: 0 1; text-style: bold; background: $primary-darken-3; }
    #alarms { height: auto; max-height: 6; padding: 0 1; background: $error-darken-2; }
    #alarms.quiet { display: none; }
    #friends { height: 1fr; }
    #help { height: 1; padding: 0 1; color: $text-muted; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("a", "order('alert ')", "alert", priority=True),
        Binding("s", "order('status ')", "status", priority=True),
        Binding("o", "order('seen ')", "seen", priority=True),
        Binding("x", "order('here ')", "here", priority=True),
        Binding("escape", "leave", "leave", priority=True),
        Binding("q", "quit", "quit", priority=True),
    ]
    ENABLE_COMMAND_PALETTE = False

    def __init__(
        self,
        view: WatchView,
        take: Callable[[], Iterable[Envelope]],
        send: Callable[[Message], None],
        now_ns: Callable[[], int],
        soldier: str,
    ) -> None:
        super().__init__()
        self._view = view
        self._take = take
        self._send = send
        self._now_ns = now_ns
        self._soldier = soldier
        self._shown: dict[str, str] = {}
        self._rows: list[list[Text]] = []

    def compose(self) -> ComposeResult:
        """From top to bottom."""
        yield Static(id="own", markup=False)
        yield Static(id="alarms", markup=False)
        yield DataTable(id="friends", cursor_type="none", zebra_stripes=True)
        yield Input(id="order", placeholder=_HELP, select_on_focus=False)
        yield Static(_HELP, id="help", markup=False)

    def on_mount(self) -> None:
        """Begin to look."""
        self.query_one("#friends", DataTable).add_columns("who", "", "m", "°", "floor", "± m", "heard")
        self.query_one("#friends", DataTable).focus()
        self.set_interval(_LOOK_S, self.look)
        self.look()

    def look(self) -> None:
        """Take in what has come, and say it."""
        for envelope in self._take():
            self._view.take(envelope)
        now_ns = self._now_ns()
        alarms = self._view.alarms(now_ns)
        self._put("own", "\n".join(self._view.own_lines(now_ns)))
        self._put("alarms", "\n".join(alarms))
        self.query_one("#alarms", Static).set_class(not alarms, "quiet")
        self._list(self._view.friends(now_ns)[:_MOST_FRIENDS])

    def _put(self, name: str, text: str) -> None:
        """Write what has changed: to lay the screen out anew four times a second would hold up the keys."""
        if self._shown.get(name) != text:
            self._shown[name] = text
            self.query_one(f"#{name}", Static).update(text)

    def _list(self, friends: list[Friend]) -> None:
        rows = [_row(friend) for friend in friends]
        if rows == self._rows:
            return
        self._rows = rows
        table = self.query_one("#friends", DataTable)
        table.clear()
        for row in rows:
            table.add_row(*row)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """While somebody types an order, letters are letters."""
        is_letter = action in ("order", "quit")
        return not (is_letter and isinstance(self.focused, Input)) and super().check_action(
            action, parameters
        )

    def action_order(self, beginning: str) -> None:
        """Begin to type an order."""
        order = self.query_one("#order", Input)
        order.value = beginning
        self.screen.set_focus(order)  # at once: what is typed next belongs there
        order.cursor_position = len(beginning)
        self._say(USAGE[beginning.strip()])

    def action_leave(self) -> None:
        """Type nothing."""
        self.query_one("#order", Input).value = ""
        self.screen.set_focus(self.query_one("#friends", DataTable))
        self._say(_HELP)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Send what was typed, or say how it is to be typed."""
        try:
            message = message_of(event.value, self._soldier, self._view.place, self._now_ns())
            self._send(message)
        except BootprintError as error:
            self._say(str(error))
            return
        self.action_leave()
        self._say(f"sent: {event.value}")

    def _say(self, text: str) -> None:
        self._put("help", text)


def _row(friend: Friend) -> list[Text]:
    floor = "" if friend.floor is None else str(friend.floor)
    values = (
        friend.callsign,
        friend.arrow,
        f"{friend.distance_m:.0f}",
        f"{friend.azimuth_deg:03.0f}",
        floor,
        f"{friend.radius_95_m:.0f}",
        friend.words,
    )
    return [Text(value, style=_STYLES[friend.state]) for value in values]
