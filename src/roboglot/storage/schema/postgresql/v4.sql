-- Where `roboglot connect` reaches the robot; empty: nowhere. The certificate is what is to be seen there (SHA-256).
ALTER TABLE robot_home ADD COLUMN gateway TEXT NOT NULL DEFAULT '';
ALTER TABLE robot_home ADD COLUMN certificate TEXT NOT NULL DEFAULT '';
