"""Made of docs/schema by `tools/json_schema python`."""

from dataclasses import dataclass
from typing import Any

from diastole.record import Record

@dataclass(frozen=True)
class Session(Record):
    """What a simulated session recorded."""

    cycles: int
    end: str
    expected: int
    gaps: int
    run: str
    samples: int
    simulated_seconds: float
    triggers: int
    wall_seconds: float

@dataclass(frozen=True)
class Inspection(Record):
    """What is in a run file, and whether it is sound."""

    channels: dict[str, ChannelFacts]
    clock: dict[str, float]
    duration_s: float
    events: int
    flow_segments: list[int]
    gap_records: int
    gaps: int
    pressure: StreamFacts
    problems: list[str]
    producer: str
    pump: StreamFacts
    run: str
    run_id: str
    samples: int
    scheduled_cycles: int
    segments: list[SegmentFacts]
    slices: list[SliceFacts]
    sound: bool
    started_utc: str
    stopped_on_request: bool
    trigger_faults: TriggerFaults
    triggers: int
    session: SessionFacts

@dataclass(frozen=True)
class ChannelFacts(Record):
    """A pressure channel: its range, how it was filtered and calibrated."""

    max_kPa: float | None
    min_kPa: float | None
    notes: dict[str, float | str] | None = ...
    calibration: dict[str, float | str] | None = ...
    saturated: int | None = ...

@dataclass(frozen=True)
class StreamFacts(Record):
    """A stream of rows; `expected` by the clocks."""

    expected: int | None
    irregular_steps: int
    longest_step_ms: float
    missing: int
    rate_Hz: float
    rows: int
    samples: int

@dataclass(frozen=True)
class SegmentFacts(Record):
    """A segment of the protocol."""

    cycles: int
    offset_mL: float
    period_s: float
    start_s: float
    stroke_mL: float
    waveform: str

@dataclass(frozen=True)
class SliceFacts(Record):
    """The cycles of one image slice."""

    slice: int
    block: str
    first_trigger: int
    triggers: int
    cycles: int
    dummy_cycles: int

@dataclass(frozen=True)
class TriggerFaults(Record):
    extra: int
    missing: int
    non_periodic: int

@dataclass(frozen=True)
class SessionFacts(Record):
    """What the people at the rig know of a run."""

    specimen: str | None
    operator: str | None
    room_temperature_C: float | None
    notes: list[SessionNote]

@dataclass(frozen=True)
class SessionNote(Record):
    """What somebody wrote about a run."""

    written_utc: str
    author: str
    text: str

@dataclass(frozen=True)
class FrameBins(Record):
    """Pressure averaged into image frames of the cycle."""

    delay_removed_s: float
    delay_source: str
    excluded: list[dict[str, Any]]
    frames: list[FrameBin]
    interval_s: float
    period_s: float
    run: str
    scheduled_cycles: int
    segment: int
    triggers: int

@dataclass(frozen=True)
class FrameBin(Record):
    """The mean over the cycles, with its scatter and drift."""

    cycles: int
    drift_kPa_per_cycle: float
    drift_se_kPa_per_cycle: float
    frame: int
    from_s: float
    mean_kPa: float
    sample_sd_kPa: float
    samples: int
    sd_kPa: float
    to_s: float

@dataclass(frozen=True)
class Catalogue(Record):
    """What a catalogue search found."""

    folder: str
    index: str
    files: int
    read: int
    removed: int
    matched: int
    page: str | None
    entries: list[CatalogueEntry]

@dataclass(frozen=True)
class CatalogueEntry(Record):
    """A run, a fit, an explanation or a folder of images."""

    path: str
    kind: str
    date: str
    specimen: str
    operator: str
    room_temperature_C: float | None
    protocol: str
    duration_s: float | None
    cycles: int | None
    peak_kPa: float | None
    sound: bool | None
    problem: str
    verdict: str
    effects: str
    parameter: str
    stiffness_kPa: float | None
    stiffness_se_kPa: float | None
    notes: str

@dataclass(frozen=True)
class Comparison(Record):
    """What tells runs apart; the first is what the others are compared with."""

    runs: list[str]
    differences: list[Difference]
    overlays: list[Overlay]
    remarks: list[str]
    is_tested: bool
    beyond_noise: bool
    undecided: bool
    page: str | None

@dataclass(frozen=True)
class Difference(Record):
    """One thing that is not the same in all runs; empty: a run does not say."""

    group: str
    place: str
    values: list[str]

@dataclass(frozen=True)
class Overlay(Record):
    """Mean cycles of a segment and channel."""

    segment: int
    channel: str
    period_s: float
    phase: list[float]
    cycles: list[MeanCycle]
    departures: list[RunDeparture]

@dataclass(frozen=True)
class MeanCycle(Record):
    """A run's mean cycle; `error_kPa` is the mean's."""

    run: int
    cycles: int
    mean_kPa: list[float | None]
    sd_kPa: list[float | None]
    error_kPa: list[float | None]

@dataclass(frozen=True)
class RunDeparture(Record):
    """A run's mean cycle against the first run's; beyond `limit_in_errors` it is no noise."""

    run: int
    offset_Pa: float | None
    gain: float | None
    rms_Pa: float | None
    worst_Pa: float | None
    worst_phase: float
    worst_in_errors: float
    limit_in_errors: float
    allowed_Pa: float | None
    range_Pa: float | None
    beyond_noise: bool
    undecided: bool

@dataclass(frozen=True)
class Solution(Record):
    """One equilibrium of a specimen."""

    reason: str
    pressure_kPa: float
    cavity_volume_mL: float
    cavity_volume_change_mL: float
    stored_energy_mJ: float
    forces: Forces
    fibre_tension_kPa: float
    law: str
    parameters: dict[str, float]
    mesh: list[int]
    elements: int
    dofs: int
    load_steps: int
    newton_iterations: int
    factorisations: int
    negative_pivots: int
    pressure_unknowns: int
    unstable_motions: int
    stable: bool
    findings: list[Finding]
    seconds: float
    probes: list[Probe]
    frames: list[SolvedFrame] | None = ...
    unloaded: Unloading | None = ...

@dataclass(frozen=True)
class Forces(Record):
    """What supports and cavity exert, N."""

    supports_N: dict[str, list[float]]
    cavity_N: list[float]
    unbalanced_N: float

@dataclass(frozen=True)
class Finding(Record):
    """Something about the data that their user should know."""

    severity: str
    id: str
    what: str
    where: str
    number: float | None
    unit: str
    remedy: str

@dataclass(frozen=True)
class Probe(Record):
    """Displacement, strain and stress at a point."""

    point_mm: list[float]
    displacement_mm: list[float]
    fields: dict[str, float | None] = ...

@dataclass(frozen=True)
class SolvedFrame(Record):
    time_s: float
    pressure_kPa: float
    cavity_volume_change_mL: float

@dataclass(frozen=True)
class Unloading(Record):
    """The shape without load of one that was imaged under it; null where it is not known."""

    reason: str
    reached_pressure_kPa: float
    load_steps: int
    iterations: int
    returned: bool
    cavity_imaged_mL: float | None = ...
    cavity_unloaded_mL: float | None = ...
    return_mm: float | None = ...

@dataclass(frozen=True)
class Fit(Record):
    """Parameters estimated from imaged motion and pressure."""

    format: str
    format_version: int
    study: str
    fingerprint: str
    specimen: str
    law: str
    data: str
    parameters: dict[str, FittedParameter]
    rms_mm: float
    chi2: float
    dof: int
    chi2_per_dof: float
    converged: bool
    reason: str
    iterations: int
    forward_solves: int
    seconds: float
    remarks: list[str]
    findings: list[Finding]
    mesh: list[int]
    unknowns: int
    residuals_used: int
    excluded: list[Exclusion]
    outliers_5sigma: int
    undeformed: UndeformedCheck
    frames: list[FittedFrame]
    correlation: Correlation
    directions: list[FittedDirection]
    history: list[FitIteration]
    residuals: ResidualHistogram
    section_frame: int
    sections: list[FitSection]
    posterior: PosteriorDrawing | None = ...
    pressure_offset_kPa: FittedOffset | None = ...
    robust: FittedRobust | None = ...
    images: str | None = ...
    energy: FittedEnergy | None = ...
    unloaded: FittedUnloading | None = ...

@dataclass(frozen=True)
class FittedParameter(Record):
    """A parameter; of a regional one the mean over the elements."""

    value: float
    se: float | None
    ci95: list[float | None]
    start: float
    bounds: list[float]
    at_bound: str
    profile: FittedProfile | None = ...
    posterior: FittedPosterior | None = ...
    elements: list[FittedElement] | None = ...
    smoothness: FittedSmoothness | None = ...
    variance_shares: FittedVarianceShares | None = ...

@dataclass(frozen=True)
class FittedProfile(Record):
    """From the likelihood's true shape."""

    ci95: list[float]
    at_bound: list[bool]
    value: list[float]
    cost_rise: list[float]

@dataclass(frozen=True)
class FittedPosterior(Record):
    """From draws of the posterior."""

    mean: float
    sd: float
    ci95: list[float]
    r_hat: float
    effective_draws: float

@dataclass(frozen=True)
class FittedElement(Record):
    value: float
    se: float | None
    ci95: list[float | None]

@dataclass(frozen=True)
class FittedSmoothness(Record):
    """How alike neighbouring elements were taken to be."""

    step: float
    by_evidence: bool
    none_seen: bool
    step90: list[float | None]
    effective_values: float

@dataclass(frozen=True)
class FittedVarianceShares(Record):
    """Where a parameter's variance comes from."""

    images: float
    pressures: float
    fibres: float
    geometry: float

@dataclass(frozen=True)
class Exclusion(Record):
    """Points that could not be used, and why."""

    reason: str
    points: int

@dataclass(frozen=True)
class UndeformedCheck(Record):
    points: int
    residuals: int
    chi2_per_residual: float | None
    mean_mm: float | None

@dataclass(frozen=True)
class FittedFrame(Record):
    frame: int
    time_s: float
    measured_kPa: float
    sigma_kPa: float
    estimated_kPa: float
    se_kPa: float | None
    points: int
    rms_mm: float | None
    chi2_per_point: float | None

@dataclass(frozen=True)
class Correlation(Record):
    names: list[str]
    matrix: list[list[float | None]]

@dataclass(frozen=True)
class FittedDirection(Record):
    """A combination of parameters, from the one that the data see worst."""

    relative_sd: float | None
    change: dict[str, float]

@dataclass(frozen=True)
class PosteriorDrawing(Record):
    draws: int
    accepted: float
    equilibria: int
    seconds: float

@dataclass(frozen=True)
class FitIteration(Record):
    iteration: int
    cost: float
    accepted: bool
    parameters: list[float]

@dataclass(frozen=True)
class ResidualHistogram(Record):
    edges: list[float]
    counts: list[float]

@dataclass(frozen=True)
class FitSection(Record):
    """A plane cut before and after deformation."""

    title: str
    horizontal: str
    vertical: str
    outline_before: list[PlaneCurve]
    outline_after: list[PlaneCurve]
    lines_before: list[PlaneCurve]
    lines_after: list[PlaneCurve]
    observed: PlaneCurve

@dataclass(frozen=True)
class PlaneCurve(Record):
    h_mm: list[float | None]
    v_mm: list[float | None]

@dataclass(frozen=True)
class FittedOffset(Record):
    value: float
    se: float

@dataclass(frozen=True)
class FittedRobust(Record):
    """Of a fit with a long-tailed loss."""

    degrees: float
    scale: float
    wild: int

@dataclass(frozen=True)
class FittedEnergy(Record):
    """The pressure's work as measured, and what the wall has stored at the estimate."""

    frame: int
    work_mJ: float
    sigma_mJ: float
    stored_mJ: float

@dataclass(frozen=True)
class FittedUnloading(Record):
    """The load at which the shape was imaged, and the shape without it."""

    imaged_at_kPa: float
    sigma_kPa: float
    estimated_kPa: float
    se_kPa: float
    return_mm: float
    returned: bool
    cavity_imaged_mL: float | None = ...
    cavity_unloaded_mL: float | None = ...

@dataclass(frozen=True)
class Explanation(Record):
    """Where model and recordings disagree, what is missing, and what stays open."""

    format: str
    format_version: int
    study: str
    verdict: str
    confidence: float | None
    model_error: ModelErrorSize | None
    reference: ReferenceSummary | None
    departures: list[Departure]
    cycle_scatter: list[CycleScatter]
    hints: list[Hint]
    summary: str
    converged: bool
    searches: list[SearchEnd]
    effects: list[FoundEffect]
    ambiguous_with: list[list[str]]
    where: list[Misfit]
    gap: Gap
    not_learned: str
    learned: LearnedTerm | None
    next_experiment: NextExperiment | None
    study_after: str
    evidence: list[Candidate]
    shifts: list[ParameterShift]
    steps: list[Step]
    traces: list[Trace]
    field: list[FieldResidual]
    seconds: float

@dataclass(frozen=True)
class ModelErrorSize(Record):
    """The model's own error."""

    source: str
    rms_Pa: float | None
    percent_of_range: float | None
    parts: list[ErrorPart]

@dataclass(frozen=True)
class ErrorPart(Record):
    part: str
    beyond_expected_sd: float | None

@dataclass(frozen=True)
class ReferenceSummary(Record):
    """What the references tell."""

    sessions: int
    channels: list[ReferenceMisfit]
    departures: list[Departure]

@dataclass(frozen=True)
class ReferenceMisfit(Record):
    channel: str
    rms: float | None
    percent_of_range: float | None

@dataclass(frozen=True)
class Departure(Record):
    """A part of the rig that is off from what is declared."""

    part: str
    offset: float | None
    unit: str
    sds: float | None

@dataclass(frozen=True)
class CycleScatter(Record):
    channel: str
    rms_Pa: float | None
    noise_Pa: float | None
    percent_of_range: float | None

@dataclass(frozen=True)
class Hint(Record):
    """Significant, but smaller than the model's own error."""

    id: str
    size_over_model_error: float | None
    probability: float | None

@dataclass(frozen=True)
class SearchEnd(Record):
    """How a search ended."""

    effects: list[str]
    termination: str
    of_reference: bool

@dataclass(frozen=True)
class FoundEffect(Record):
    """An effect that was named."""

    id: str
    size_over_model_error: float | None
    parameters: dict[str, FoundParameter]
    moments: list[Moment]

@dataclass(frozen=True)
class FoundParameter(Record):
    value: float | None
    unit: str
    ci90: list[float | None]
    standard_error: float | None

@dataclass(frozen=True)
class Moment(Record):
    run: str
    time_s: float

@dataclass(frozen=True)
class Misfit(Record):
    """Where the model fails."""

    port: str
    run: str
    channel: str
    segment: int | None
    phase: list[float] | None
    band_Hz: list[float] | None
    region: str | None
    excess_chi2: float | None
    p_value: float | None

@dataclass(frozen=True)
class Gap(Record):
    """Reduced chi-square on data that were not fitted."""

    before: float | None
    after: float | None
    floor: float | None
    closed: float | None
    held_out: list[str]

@dataclass(frozen=True)
class LearnedTerm(Record):
    """A law that the library lacks, learnt at one port: a suggestion, no verdict."""

    port: str
    sets: str
    variables: list[str]
    variable_unit: str
    unit: str
    curve: list[list[float | None]]
    band: list[list[float | None]]
    closed_form: str
    gap: Gap
    held_out_gain: float | None
    readings: list[str]
    shifts: list[ParameterShift]
    rivals: list[LearnedRival]
    effect_file: str
    toml: str

@dataclass(frozen=True)
class ParameterShift(Record):
    """A parameter before and after the effects were added."""

    name: str
    before: float | None
    before_error: float | None
    after: float | None
    after_error: float | None

@dataclass(frozen=True)
class LearnedRival(Record):
    """A law at another port that predicts as well."""

    port: str
    sets: str
    variables: list[str]
    effect_file: str

@dataclass(frozen=True)
class NextExperiment(Record):
    """A runnable experiment file that separates what is left."""

    toml: str
    separates: list[str]
    predicted_separation_sigma: float | None
    reason: str

@dataclass(frozen=True)
class Candidate(Record):
    """A set of effects that was weighed."""

    ids: list[str]
    chi_square_drop: float | None
    refitted: bool
    parameters: int
    held_out_drop: float | None
    verdict: str

@dataclass(frozen=True)
class Step(Record):
    added: str
    reduced_chi_square: float | None

@dataclass(frozen=True)
class Trace(Record):
    """A channel as measured, and by the two models."""

    run: str
    channel: str
    unit: str
    noise_sd: float | None
    time_s: list[float]
    measured: list[float | None]
    before: list[float | None]
    after: list[float | None]
    cavity_mL: list[float | None]
    trigger_s: list[float]

@dataclass(frozen=True)
class FieldResidual(Record):
    """A tag or point."""

    place_mm: list[float]
    frame: int
    before: float | None
    after: float | None
    per_mm: list[float | None]

@dataclass(frozen=True)
class Tracking(Record):
    """Tag points followed through the cycle."""

    points: int
    dropped: dict[str, int]
    rms_px: float | None
    coordinates: str
    seconds: float
    problems: list[Finding]
    slices: list[TrackedSlice]
    edits: AppliedEdits | None = ...
    to_specimen: SpecimenPose | None = ...
    outline: AnnulusOutline | None = ...

@dataclass(frozen=True)
class AppliedEdits(Record):
    """What was put right by hand."""

    file: str
    applied: dict[str, int]
    undone: int

@dataclass(frozen=True)
class SpecimenPose(Record):
    origin_mm: list[float]
    x_axis: list[float]
    y_axis: list[float]
    z_axis: list[float]
    source: str

@dataclass(frozen=True)
class AnnulusOutline(Record):
    inner_radius_mm: float
    outer_radius_mm: float
    height_mm: float

@dataclass(frozen=True)
class TrackedSlice(Record):
    name: str
    points: int
    dropped: dict[str, int]
    directions: list[TagDirection]
    noise_factor: list[float | None]
    phases: list[TrackedPhase]

@dataclass(frozen=True)
class TagDirection(Record):
    normal: list[float]
    spacing_mm: float

@dataclass(frozen=True)
class TrackedPhase(Record):
    frame: int
    trigger_ms: float | None
    points: int
    rms_px: float | None
    residual: float | None
