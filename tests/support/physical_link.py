"""A rover in physics and the session that commands it, without a server between them."""

from footfall.telemetry.link import CommandMessage, decode


class Linked:
    """A rover in physics at the end of a session's link; it runs as fast as it can be computed."""

    def __init__(self, live, rover):
        self.live, self.rover = live, rover
        self.waiting = []
        live.rover.connected(lambda text: self.waiting.append(decode(text)))
        self.report()

    def report(self):
        self.live.rover.take_telemetry(self.rover.frame())

    def run(self, look=lambda: None):
        """Until nothing is commanded any more; ``look`` at every moment that is told."""
        while self.waiting or self.rover.mode == "moving":
            while self.waiting:
                message = self.waiting.pop(0)
                if isinstance(message, CommandMessage):
                    self.hear(self.rover.command(message))
            said = self.rover.step(0.04)
            self.report()
            look()
            self.hear(said)

    def hear(self, said):
        for ack in said:
            self.live.rover.take_acknowledgement(ack.id, ack.state, ack.reason)
