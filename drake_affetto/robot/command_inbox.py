"""What clients send: the last good command, and what else came in."""

from collections.abc import Sequence
import dataclasses

from drake_affetto.robot.wire import PacketCodec, PacketError

# Time in which packets of two senders are those of two clients at once, s.
_AT_ONCE = 0.5


@dataclasses.dataclass
class CommandInbox:
    """Keeps the last good command and counts packets.

    Attributes:
        codec: Reads the packets.
        timeout: Time without good packets after which the client is silent, s.
        holds: Whether the last command holds then; else all chambers vent.
        levels: The command that holds now (2n), 0..255, in the wire's order.
        good: Number of good packets.
        bad: Number of the others.
        clients: Number of senders so far.
        notes: What happened, in words, for whoever shows it; emptied there.
        last: When the last good packet came, s; None before the first.
    """

    codec: PacketCodec
    timeout: float
    holds: bool
    levels: Sequence[float] = ()
    good: int = 0
    bad: int = 0
    clients: int = 0
    notes: list[str] = dataclasses.field(default_factory=list)
    last: float | None = None
    _sender: object = None
    _other: tuple[object, float] = (None, 0.0)
    _silent: bool = True
    _told: bool = False

    def __post_init__(self) -> None:
        """Vents all until the first command."""
        self._vented = [0] * (2 * self.codec.num_joints)
        self.levels = self._vented

    def take(self, packet: bytes, sender: object, now: float) -> None:
        """Takes a packet.

        Args:
            packet: Its bytes.
            sender: Who sent it; only compared.
            now: When it came, s.
        """
        try:
            levels = self.codec.read_levels(packet)
        except PacketError as error:
            self.bad += 1
            if self.bad == 1:
                self.notes.append(f"a packet is no command: {error}")
            return
        self.good += 1
        self._note_sender(sender, now)
        self.levels, self.last, self._silent = levels, now, False

    def _note_sender(self, sender: object, now: float) -> None:
        if sender == self._sender:
            return
        other, when = self._other
        if sender == other and now - when < _AT_ONCE:
            if not self._told:
                self._told = True
                self.notes.append(
                    "two clients send at once; the last packet counts"
                )
        else:
            self.clients += 1
            self.notes.append(f"client {self.clients} sends commands")
        self._other, self._sender = (self._sender, now), sender

    def watch(self, now: float) -> None:
        """Sees whether the client has fallen silent; vents if it is told to.

        Args:
            now: Time, s.
        """
        if self._silent or self.last is None or now - self.last < self.timeout:
            return
        self._silent = True
        if self.holds:
            outcome = "the last command holds"
        else:
            outcome = "all chambers vent"
            self.levels = self._vented
        self.notes.append(f"no command for {self.timeout:g} s: {outcome}")
