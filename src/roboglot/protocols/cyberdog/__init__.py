"""CyberDog 2's door: the phone app's gRPC service, in both directions."""

from roboglot.protocols.cyberdog.certificates import ensure_certificates, export_client
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.cyberdog.table import implemented, partly

__all__ = ["CyberDogDoor", "ensure_certificates", "export_client", "implemented", "partly"]
