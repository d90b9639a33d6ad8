"""Traces: what a run leaves behind."""


class Trace:
    """Columns over time and events of a run.

    `trace["x_m"]` is a NumPy array of a value a tick, in SI, made without a copy; titles are those of `run --out`. Of a
    state machine the values count `labels[title]`.
    """

    def __init__(self, run):
        self._run = run
        self._columns = run.columns
        self._events = None

    @property
    def instrument(self):
        """The name of the instrument."""
        return self._run.instrument

    @property
    def engine(self):
        """The engine."""
        return self._run.engine

    @property
    def rate_hz(self):
        """Ticks per second."""
        return self._run.rate_hz

    @property
    def t(self):
        """The time of every tick (s)."""
        import numpy

        return self._run.start_s + numpy.arange(len(self)) / self.rate_hz

    @property
    def labels(self):
        """Of each column of a state machine the names of its states."""
        return self._run.labels

    @property
    def events(self):
        """What happened: a dict with `t_s`, `event` and its arguments for each, in the order of time."""
        if self._events is None:
            self._events = self._run.events
        return self._events

    @property
    def counts(self):
        """In how many ticks a sensor, a range or a drive was at its end."""
        return self._run.counts

    def notes(self, name="note"):
        """The events of a name."""
        return [event for event in self.events if event["event"] == name]

    def __getitem__(self, title):
        try:
            return self._columns[title]
        except KeyError:
            raise KeyError(f"there is no column {title!r}; there are {', '.join(self._columns)}") from None

    def __contains__(self, title):
        return title in self._columns

    def __iter__(self):
        return iter(self._columns)

    def keys(self):
        """The titles, so that `dict(trace)` and `numpy.savez(file, **trace)` work."""
        return self._columns.keys()

    def __len__(self):
        return self._run.ticks

    def __repr__(self):
        seconds = len(self) / self.rate_hz
        return f"<whippen.Trace {self.instrument} on {self.engine}, {seconds:.3f} s, {len(self._columns)} columns>"

    def svg(self):
        """The picture that `whippen run --plot` draws."""
        return self._run.svg()

    def _repr_svg_(self):
        return self.svg()
